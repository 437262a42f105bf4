//! The help page: the keys and the marks.

use ratatui::text::Line;

pub fn lines() -> Vec<Line<'static>> {
    [
        " A               open the arming dialog (step 1);",
        "                 then type ARM and Enter within 10 s (step 2)",
        " S               start the countdown: then START and Enter within 10 s",
        " D, Enter        disarm",
        " Ctrl-X Enter    ABORT, from anywhere: Enter within 2 s, or Ctrl-X again;",
        "                 a held key is one press. Sent until the vehicle has latched it",
        " Space           acknowledge the shown alarm; 9 lists them, Up Down choose",
        " 1 to 9          show a page and hold it; h holds the present one; ? this help",
        " 0 or Esc        follow the flight again",
        " Up Down PgUp PgDn Home End   scroll a list",
        " Ctrl-L          draw the screen again",
        " In a replay: Space, Left, Right, [ and ] (phases), + and - (speed), g, G",
        " q, Ctrl-C       quit; armed or in flight only with QUIT and Enter",
        " ~ before a value: older than 1.5 s. Commanded, acknowledged and",
        " observed are three facts; armed is what HEARTBEAT says.",
        " o command, # actual. The line is flown, the dots are planned. After a loss",
        " of the link, + is the PREDICTED position, with a circle that contains it in",
        " 19 of 20 cases. Fins: N is north, P points to the pad. * computed on ground.",
    ]
    .into_iter()
    .map(Line::raw)
    .collect()
}
