//! The keys, explained.

use ratatui::text::Line;

/// The screen's lines.
pub fn lines() -> Vec<Line<'static>> {
    [
        " A               open the arming dialog (step 1);",
        "                 then type ARM and Enter within 10 s (step 2)",
        " S               start the countdown: then START and Enter within 10 s",
        " D, Enter        disarm",
        " Ctrl-X Enter    ABORT, from anywhere: Enter within 2 s, or Ctrl-X again;",
        "                 a held key is one press. Sent until the vehicle has latched it",
        " Space           acknowledge the alarm of the line; 9 lists them, Up Down choose",
        " 1 to 9          show a screen and hold it; h holds the present one; ? these keys",
        " 0 or Esc        follow the flight again",
        " Up Down PgUp PgDn Home End   scroll a list",
        " Ctrl-L          draw the screen again",
        " In a replay: Space, Left, Right, [ and ] (phases), + and - (speed), g, G",
        " q, Ctrl-C       quit; armed or in flight only with QUIT and Enter",
        " ~ before a value: older than 1.5 s. Commanded, acknowledged and",
        " observed are three facts; armed is what HEARTBEAT says.",
        " o command, # actual. A line is flown, dots are planned; after the",
        " loss of the link the position is a PREDICTION, + and the circle that holds it",
        " 19 times in 20. From above N is north, P the way to the pad. * computed here.",
    ]
    .into_iter()
    .map(Line::raw)
    .collect()
}
