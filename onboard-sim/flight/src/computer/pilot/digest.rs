//! A digest of everything that a pilot remembers.

use super::known::Known;
use super::{Outlook, Pilot};
use crate::computer::memory::remembers;
use crate::guidance::ignition::IgnitionOutlook;
use crate::guidance::vertical::Band;

remembers!(Pilot {
    known,
    estimator,
    estimate,
    ascent,
    apogee_m,
    ignited_at_s,
    outlook,
    powered,
    baseline,
    aim_loop,
    fin_share,
    fins_rad,
    fin_watch,
    gimbal_rad,
    gate_refusal,
    gate_shut_since_s,
});

// The mission, its motor and its masses come from the profile in the log; they do not change in flight.
remembers!(Known { motor } but { mission, mass });

remembers!(Outlook {
    ignition,
    commit_height_m,
    height_m,
    predicted_speed_m_s,
    lands_ahead,
    touchdown_distance_m
});
remembers!(IgnitionOutlook { band, common, chosen_m, onset_height_m, onset_vertical_m_s, command_in_s });
remembers!(Band { low_m, high_m });
