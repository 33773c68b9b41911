//! The layout that a viewer opens: the scene on the left, the plots on the right, those of snow in a column of
//! their own.
//!
//! Enters: where the camera is, what the scene is made of. Leaves: a blueprint in the recording.

use crate::{
    camera::Camera,
    error::{RerunError, refused},
    loads::LOADS,
    plots::{CLOTH, GENERAL, Plot},
    sdk::{
        AsComponents, Color, EntityPath, LogMsg, RecordingStream, RecordingStreamBuilder,
        RecordingStreamResult,
        blueprint::{
            Background, Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, EyeControls3D,
            Horizontal, LineGrid3D, PlotLegend, SelectionPanel, Spatial3DView, StateTimelineView,
            TextLogView, TimePanel, TimeSeriesView, Vertical,
            components::{BackgroundKind, Corner2D, PanelState},
        },
    },
    snow_plots::{BOUND_LOG, BOUND_STATE, SNOW},
};

/// The name under which viewers keep layouts.
pub(crate) const APPLICATION: &str = "nappe";
/// The timeline of simulated time.
pub(crate) const TIME: &str = "time";

const BACKGROUND: [u8; 3] = [22, 25, 30];

/// A setting of a view: the view's path, the setting's name and value.
type Property = (EntityPath, &'static str, Box<dyn AsComponents>);

/// What a scene is made of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct BodyKinds {
    pub(crate) has_cloth: bool,
    pub(crate) has_snow: bool,
    pub(crate) has_colliders: bool,
}

/// Sends the layout.
pub(crate) fn send(stream: &RecordingStream, camera: Camera, kinds: BodyKinds) -> Result<(), RerunError> {
    let mut properties: Vec<Property> = Vec::new();
    let scene: ContainerLike = Spatial3DView::new("Scene").with_origin("world").into();
    properties.extend(scene_properties(&path_of(&scene), camera));

    let cloth = if kinds.has_cloth { &CLOTH[..] } else { &[] };
    let mut general = views(GENERAL.iter().chain(cloth), &mut properties);
    if kinds.has_colliders {
        let loads = TimeSeriesView::new("Force on colliders (N)").with_origin(LOADS).into();
        let legend = PlotLegend::new().with_visible(true).with_corner(Corner2D::RightTop);
        properties.push((path_of(&loads), "PlotLegend", Box::new(legend)));
        general.push(loads);
    }

    let mut columns = vec![scene, column(general)];
    if kinds.has_snow {
        let mut snow = views(SNOW.iter(), &mut properties);
        snow.insert(1, StateTimelineView::new("What bounds the step").with_origin(BOUND_STATE).into());
        snow.push(TextLogView::new("Changes of the bound").with_origin(BOUND_LOG).into());
        columns.push(column(snow));
    }

    let shares: Vec<f32> = (0..columns.len()).map(|column| if column == 0 { 3.0 } else { 1.0 }).collect();
    let blueprint = Blueprint::new(Horizontal::new(columns).with_column_shares(shares))
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(TimePanel::new().with_state(PanelState::Collapsed).with_timeline(TIME));
    send_with(stream, &blueprint, &properties).map_err(refused("the layout"))
}

/// A view of each plot, with its legend.
fn views<'a>(plots: impl Iterator<Item = &'a Plot>, properties: &mut Vec<Property>) -> Vec<ContainerLike> {
    plots
        .map(|plot| {
            let view = TimeSeriesView::new(plot.title).with_origin(plot.path).into();
            properties.push((path_of(&view), "PlotLegend", Box::new(legend(plot))));
            view
        })
        .collect()
}

/// The first has the largest legend.
fn column(views: Vec<ContainerLike>) -> ContainerLike {
    let shares: Vec<f32> = (0..views.len()).map(|row| if row == 0 { 1.6 } else { 1.0 }).collect();
    Vertical::new(views).with_row_shares(shares).into()
}

fn path_of(view: &ContainerLike) -> EntityPath {
    match view {
        ContainerLike::View(view) => view.blueprint_path(),
        _ => unreachable!("a view is no container"),
    }
}

fn scene_properties(view: &EntityPath, camera: Camera) -> [Property; 3] {
    let eye = EyeControls3D::new()
        .with_position(camera.eye)
        .with_look_target(camera.target)
        .with_eye_up([0.0, 1.0, 0.0]);
    let [red, green, blue] = BACKGROUND;

    let background =
        Background::new(BackgroundKind::SolidColor).with_color(Color::from_rgb(red, green, blue));

    // The floor of a scene is one of its colliders, at its own height.
    let grid = LineGrid3D::new().with_visible(false);
    [
        (view.clone(), "EyeControls3D", Box::new(eye)),
        (view.clone(), "Background", Box::new(background)),
        (view.clone(), "LineGrid3D", Box::new(grid)),
    ]
}

/// The title names a series that is alone.
fn legend(plot: &Plot) -> PlotLegend {
    PlotLegend::new().with_visible(plot.has_several_series()).with_corner(Corner2D::RightTop)
}

/// The SDK's layout types cannot set a camera yet: the settings of views are added to the messages of the
/// layout, before the one that makes the layout active.
fn send_with(
    stream: &RecordingStream,
    blueprint: &Blueprint,
    properties: &[Property],
) -> RecordingStreamResult<()> {
    let (scratch, storage) = RecordingStreamBuilder::new(APPLICATION).memory()?;
    blueprint.send(&scratch, BlueprintActivation::default())?;
    let mut messages: Vec<_> =
        storage.take().into_iter().filter(|message| message.store_id().is_blueprint()).collect();
    let Some(LogMsg::BlueprintActivationCommand(activation)) = messages.pop() else {
        unreachable!("the SDK ends a blueprint with its activation")
    };

    let id = activation.blueprint_id.recording_id().clone();
    let (extra, storage) = RecordingStreamBuilder::new(APPLICATION).recording_id(id).blueprint().memory()?;
    extra.set_time_sequence("blueprint", 0);
    for (view, name, value) in properties {
        extra.log(view.join(&(*name).into()), value.as_ref())?;
    }
    messages.extend(storage.take().into_iter().filter(|message| matches!(message, LogMsg::ArrowMsg(..))));
    stream.send_blueprint(messages, activation);
    Ok(())
}
