//! How the viewer shows the recording: its blueprint. Every other field can be dragged into a plot.

use rerun::archetypes::SeriesLines;
use rerun::blueprint::components::PanelState;
use rerun::blueprint::{
    Blueprint, BlueprintPanel, ContainerLike, Grid, Horizontal, SelectionPanel, Spatial3DView, TextLogView,
    TimePanel, TimeSeriesView, Vertical, VisualizableArchetype as _, Visualizer, VisualizerComponentMapping,
};

use crate::export::{BESIDE, FLIGHT_TIME};

/// A plot: its title, the topic and the message that it shows, and the fields.
pub type Plot = (&'static str, [&'static str; 2], &'static [&'static str]);

const TRUTH: [&str; 2] = ["/vehicle/truth3d", "touchdown.flight.v1.TruthSample"];
const TIMING: [&str; 2] = ["/pilot/timing", "touchdown.flight.v1.PilotTiming"];
const TELEMETRY: [&str; 2] = ["/telemetry", "touchdown.log.v1.Telemetry"];

pub const PLOTS: [Plot; 11] = [
    ("Height of the feet, m", TRUTH, &[".height_m"]),
    ("Vertical speed, m/s", TRUTH, &[".state.velocity_m_s.z"]),
    ("Horizontal position, m", TRUTH, &[".state.position_m.x", ".state.position_m.y"]),
    ("Horizontal speed, m/s", TRUTH, &[".state.velocity_m_s.x", ".state.velocity_m_s.y"]),
    ("Gimbal in pitch, rad", TRUTH, &[".gimbal_commanded_rad[0]", ".gimbal_actual_rad[0]"]),
    ("Gimbal in yaw, rad", TRUTH, &[".gimbal_commanded_rad[1]", ".gimbal_actual_rad[1]"]),
    ("Thrust, N", TRUTH, &[".thrust_n"]),
    ("Time of a frame that plans, s", TIMING, &[".solve_time_s", ".deadline_s"]),
    ("Altitude, m (telemetry)", TELEMETRY, &[".altitude_m"]),
    ("Tilt, rad (telemetry)", TELEMETRY, &[".tilt_rad"]),
    ("Gimbal in pitch, rad (telemetry)", TELEMETRY, &[".gimbal_commanded_rad[0]", ".gimbal_measured_rad[0]"]),
];

/// The component that the import makes of a message.
pub fn component(message: &str) -> String {
    format!("{message}:message")
}

fn view(&(title, [topic, message], fields): &Plot) -> ContainerLike {
    let entities = ["", BESIDE].map(|below| format!("{below}{topic}"));
    let view = TimeSeriesView::new(title).with_origin("/").with_contents(entities.clone());
    let lines = |suffix: &str| -> Vec<Visualizer> {
        let line = |field: &&str| {
            let source = VisualizerComponentMapping::new_source_component_with_selector(
                "Scalars:scalars",
                component(message),
                *field,
            );
            let name = format!("{}{suffix}", field.trim_start_matches('.'));
            SeriesLines::new().with_names([name]).visualizer().with_mappings([source.into()])
        };
        fields.iter().map(line).collect()
    };
    let [own, beside] = entities;
    view.with_overrides(own, lines("")).with_overrides(beside, lines(" (beside)")).into()
}

/// The space, the events, and the plots of the topics that the recording has.
pub(crate) fn layout(topics: &[String]) -> Blueprint {
    let drawn = ["", BESIDE].map(|below| format!("{below}/world/**"));
    let flight = Spatial3DView::new("Flight").with_origin("/").with_contents(drawn.clone());
    let rocket = Spatial3DView::new("Rocket").with_origin("/world/followed").with_contents(drawn);
    let spaces = Horizontal::new([flight.into(), rocket.into()]).with_column_shares([3.0, 2.0]);
    let events = ["", BESIDE].map(|below| format!("{below}/events"));
    let events = TextLogView::new("Events").with_origin("/").with_contents(events);
    let left = Vertical::new([spaces.into(), events.into()]).with_row_shares([3.0, 1.0]);
    let plots = PLOTS.iter().filter(|(_, [shown, _], _)| topics.iter().any(|topic| topic == shown)).map(view);
    let right = Grid::new(plots.collect::<Vec<_>>()).with_grid_columns(2);
    Blueprint::new(Horizontal::new([left.into(), right.into()]).with_column_shares([5.0, 4.0]))
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Hidden))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Hidden))
        .with_time_panel(TimePanel::new().with_state(PanelState::Collapsed).with_timeline(FLIGHT_TIME))
        .with_auto_views(false)
}
