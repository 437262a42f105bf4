//! How the viewer shows the recording: its blueprint.
//!
//! The paths and archetypes are the viewer's own
//! (<https://rerun.io/docs/reference/types/archetypes>, blueprint archetypes); they are written one by one because
//! the ready-made builders have no camera, no grid and no time range.

use rerun::components::Plane3D;
use rerun::datatypes::{TimeInt, TimeRange, TimeRangeBoundary, Uuid, VisibleTimeRange};
use rerun::external::re_log_types::BlueprintActivationCommand;
use rerun::external::re_sdk_types::blueprint::archetypes::{
    ContainerBlueprint, EyeControls3D, LineGrid3D, PanelBlueprint, PlotLegend, TextLogColumns,
    TimePanelBlueprint, ViewBlueprint, ViewContents, ViewportBlueprint, VisibleTimeRanges,
};
use rerun::external::re_sdk_types::blueprint::components::{
    ColumnShare, ContainerKind, Corner2D, Eye3DKind, IncludedContent, PanelState, QueryExpression,
    RootContainer, RowShare, TimelineName, ViewClass,
};
use rerun::external::re_sdk_types::blueprint::datatypes::{TextLogColumn, TextLogColumnKind};
use rerun::{
    AsComponents, RecordingStream, RecordingStreamBuilder, RecordingStreamResult, StoreId, StoreKind,
};

use crate::entity;
use crate::plot_list::Plot;
use crate::scene::Extent;

/// Sends the layout of a recording.
pub(crate) fn send_layout(
    recording: &RecordingStream,
    application: &'static str,
    extent: &Extent,
    plots: &[&Plot],
    phases_as_text: bool,
) -> RecordingStreamResult<()> {
    let blueprint_id = StoreId::random(StoreKind::Blueprint, application);
    let (stream, messages) =
        RecordingStreamBuilder::from_store_id(&blueprint_id).send_properties(false).enabled(true).memory()?;
    stream.set_time_sequence("blueprint", 0);
    let mut layout = Layout { stream: &stream, made: 0 };
    let root = layout.whole(extent, plots, phases_as_text)?;
    stream.log("viewport", &ViewportBlueprint::new().with_root_container(root).with_auto_views(false))?;
    for panel in ["blueprint_panel", "selection_panel"] {
        stream.log(panel, &PanelBlueprint::new().with_state(PanelState::Hidden))?;
    }
    let time_panel = TimePanelBlueprint::new()
        .with_state(PanelState::Collapsed)
        .with_timeline(TimelineName(entity::TIMELINE_FLIGHT_TIME.into()));
    stream.log("time_panel", &time_panel)?;
    stream.flush_blocking().ok();
    let activation = BlueprintActivationCommand { blueprint_id, make_active: true, make_default: true };
    recording.send_blueprint(messages.take(), activation);
    Ok(())
}

struct Layout<'a> {
    stream: &'a RecordingStream,
    made: u64,
}

/// A view or a container of the layout.
struct Part {
    path: String,
    id: Uuid,
}

/// Properties of a view: path below the view, and content.
type Properties<'p> = [(&'p str, &'p dyn AsComponents)];

impl Layout<'_> {
    fn whole(
        &mut self,
        extent: &Extent,
        plots: &[&Plot],
        phases_as_text: bool,
    ) -> RecordingStreamResult<RootContainer> {
        let overview = self.overview(extent)?;
        let close_up = self.close_up(extent)?;
        let spaces = self.container(ContainerKind::Horizontal, &[&overview, &close_up], &[3.0, 2.0])?;
        let states = self.view("StateTimeline", "Phase and control level", "states", &["$origin/**"], &[])?;
        let mut texts = vec!["+ /log/events", "+ /log/replay", "+ /log/verdict", "+ /log/beside/**"];
        if phases_as_text {
            texts.push("+ /log/phases");
        }
        let columns = [TextLogColumnKind::LogLevel, TextLogColumnKind::Body]
            .map(|kind| TextLogColumn { visible: true.into(), kind });
        let columns = TextLogColumns::new().with_text_log_columns(columns);
        let log = self.view("TextLog", "Events", "log", &texts, &[("TextLogColumns", &columns)])?;
        let report = self.view("TextDocument", "Verdict and run", entity::REPORT, &["$origin"], &[])?;
        let words = self.container(ContainerKind::Horizontal, &[&log, &report], &[3.0, 2.0])?;
        let left = self.container(ContainerKind::Vertical, &[&spaces, &states, &words], &[4.6, 1.7, 2.6])?;
        let plots = plots
            .iter()
            .map(|plot| {
                let origin = format!("{}/{}", entity::PLOTS, plot.name);
                let legend = PlotLegend::new().with_corner(Corner2D::RightTop).with_visible(plot.legend);
                self.view("TimeSeries", plot.title, &origin, &["$origin/**"], &[("PlotLegend", &legend)])
            })
            .collect::<RecordingStreamResult<Vec<_>>>()?;
        let plots: Vec<&Part> = plots.iter().collect();
        let right = self.container(ContainerKind::Grid, &plots, &[1.0, 1.0])?;
        let root = self.container(ContainerKind::Horizontal, &[&left, &right], &[5.0, 4.0])?;
        Ok(RootContainer(root.id))
    }

    /// The whole flight from the side, x to the right.
    fn overview(&mut self, extent: &Extent) -> RecordingStreamResult<Part> {
        let (left_m, right_m) = extent.x_m;
        let middle_m = f32::midpoint(left_m, right_m);
        let height_m = (extent.top_m - extent.ground_z_m).max(right_m - left_m).max(4.0 * extent.rocket_m);
        let target_m = [middle_m, 0.0, extent.ground_z_m + 0.45 * height_m];
        let eye = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position([middle_m + 0.45 * height_m, -1.25 * height_m, target_m[2] + 0.25 * height_m])
            .with_look_target(target_m)
            .with_eye_up([0.0, 0.0, 1.0]);
        let grid = LineGrid3D::new().with_plane(Plane3D::new([0.0, 0.0, 1.0], extent.ground_z_m));
        self.space("Flight", entity::WORLD, &["+ /world/**"], &eye, &grid)
    }

    /// The camera follows the rocket but does not turn with it.
    fn close_up(&mut self, extent: &Extent) -> RecordingStreamResult<Part> {
        let eye = EyeControls3D::new()
            .with_kind(Eye3DKind::Orbital)
            .with_position([0.8 * extent.rocket_m, -3.4 * extent.rocket_m, 0.5 * extent.rocket_m])
            .with_look_target([0.0, 0.0, -0.5 * extent.rocket_m])
            .with_eye_up([0.0, 0.0, 1.0]);
        // A grid would move with the camera, so there is none.
        let grid = LineGrid3D::new().with_visible(false);
        let contents = ["+ /world/**".to_owned(), format!("- /{}", entity::MARKER)];
        let contents = contents.each_ref().map(String::as_str);
        self.space("Rocket", entity::FOLLOWED, &contents, &eye, &grid)
    }

    fn space(
        &mut self,
        name: &str,
        origin: &str,
        contents: &[&str],
        eye: &EyeControls3D,
        grid: &LineGrid3D,
    ) -> RecordingStreamResult<Part> {
        let so_far = VisibleTimeRanges::new([VisibleTimeRange {
            timeline: entity::TIMELINE_FLIGHT_TIME.into(),
            range: TimeRange {
                start: TimeRangeBoundary::Infinite,
                end: TimeRangeBoundary::CursorRelative(TimeInt(0)),
            },
        }]);
        let trail = format!("ViewContents/overrides/{}/visualizers", entity::TRAIL);
        let properties: [(&str, &dyn AsComponents); 3] =
            [("EyeControls3D", eye), ("LineGrid3D", grid), (&trail, &so_far)];
        self.view("3D", name, origin, contents, &properties)
    }

    fn view(
        &mut self,
        class: &str,
        name: &str,
        origin: &str,
        contents: &[&str],
        properties: &Properties<'_>,
    ) -> RecordingStreamResult<Part> {
        let part = self.part("view");
        let query = contents.iter().map(|line| QueryExpression((*line).into()));
        self.stream.log(format!("{}/ViewContents", part.path), &ViewContents::new(query))?;
        let view =
            ViewBlueprint::new(ViewClass(class.into())).with_display_name(name).with_space_origin(origin);
        self.stream.log(part.path.as_str(), &view)?;
        for (below, content) in properties {
            self.stream.log(format!("{}/{below}", part.path), *content)?;
        }
        Ok(part)
    }

    fn container(
        &mut self,
        kind: ContainerKind,
        contents: &[&Part],
        shares: &[f32],
    ) -> RecordingStreamResult<Part> {
        let part = self.part("container");
        let included = contents.iter().map(|content| IncludedContent(content.path.as_str().into()));
        let container = ContainerBlueprint::new(kind).with_contents(included);
        let container = match kind {
            ContainerKind::Vertical => {
                container.with_row_shares(shares.iter().map(|share| RowShare((*share).into())))
            }
            ContainerKind::Grid => container.with_grid_columns(shares.len() as u32),
            _ => container.with_col_shares(shares.iter().map(|share| ColumnShare((*share).into()))),
        };
        self.stream.log(part.path.as_str(), &container)?;
        Ok(part)
    }

    /// A unique id in the layout.
    fn part(&mut self, kind: &str) -> Part {
        self.made += 1;
        let mut bytes = [0; 16];
        bytes[8..].copy_from_slice(&self.made.to_be_bytes());
        let path = format!("{kind}/00000000-0000-0000-0000-{:012x}", self.made);
        Part { path, id: Uuid { bytes } }
    }
}
