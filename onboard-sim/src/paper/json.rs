//! The paper's experiments as JSON.

use flight::vehicle::dynamics::PlanarState;
use serde_json::{Value, json};

use super::{AsPrinted, Experiments, Finish, Objective, Row};

/// Everything as one JSON value; units in the names, angles in degrees as in the paper.
pub fn to_json(experiments: &Experiments, printed: &AsPrinted) -> Value {
    json!({
        "rows": experiments.rows.iter().map(row).collect::<Vec<_>>(),
        "objective": objective(&experiments.objective),
        "as_printed": {
            "thrust_n": printed.thrust_n,
            "landable": printed.best_touchdown_speed_m_s <= printed.limit_m_s,
            "best_touchdown_speed_m_s": printed.best_touchdown_speed_m_s,
            "limit_m_s": printed.limit_m_s,
            "coasting_energy_error_j_kg": {
                "as_printed": printed.energy_error_j_kg[0],
                "consistent": printed.energy_error_j_kg[1],
            },
            "promised": state(&printed.promised),
            "promised_vertical_m_s": printed.promised_vertical_m_s,
            "promised_lowest_m": printed.promised_lowest_m,
            "promise_converged": printed.promise_converged,
            "happens": printed.happens.as_ref().map(state),
        },
    })
}

fn objective(objective: &Objective) -> Value {
    let ours = objective
        .definitions
        .iter()
        .map(|definition| json!({ "definition": definition.name.trim_start(), "values": definition.values }));
    json!({
        "input_weights": objective.weights,
        "paper": objective.paper,
        "cost_rate_at_the_papers_final_states": objective.at_paper_finals,
        "ours": ours.collect::<Vec<_>>(),
    })
}

fn row(row: &Row) -> Value {
    json!({
        "table": row.case.table.title(),
        "case": row.case.name(),
        "start": {
            "pitch_deg": row.case.pitch_deg,
            "w_m_s": row.case.w_m_s,
            "pitch_rate_deg_s": row.case.pitch_rate_deg_s,
        },
        "input_weight": row.case.input_weight,
        "paper": row.case.paper.map(|paper| json!({
            "state": state(&paper.state()),
            "inside_table_2": row.paper_landed,
        })),
        "open_loop": finish(&row.open_loop),
        "closed_loop": finish(&row.closed_loop),
    })
}

fn finish(finish: &Finish) -> Value {
    json!({
        "state": state(&finish.state),
        "cost": finish.cost,
        "converged": finish.converged,
        "inside_table_2": finish.verdict.landed(),
    })
}

fn state(state: &PlanarState) -> Value {
    json!({
        "x_m": state.x_m,
        "z_m": state.z_m,
        "pitch_deg": state.theta_rad.to_degrees(),
        "u_m_s": state.u_m_s,
        "w_m_s": state.w_m_s,
        "pitch_rate_deg_s": state.q_rad_s.to_degrees(),
    })
}
