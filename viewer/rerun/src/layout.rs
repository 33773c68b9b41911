//! The layout that a viewer opens: the scene on the left, the figures on the right.
//!
//! Enters: the bounds of the scene (m). Leaves: a blueprint in the recording, with a camera that sees all of it.

use rerun::{
    EntityPath, RecordingStream, RecordingStreamBuilder,
    blueprint::{
        Blueprint, BlueprintActivation, BlueprintPanel, ContainerLike, Horizontal, SelectionPanel,
        Spatial3DView, TimePanel, TimeSeriesView, Vertical,
        components::{BackgroundKind, PanelState},
    },
    external::re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, LineGrid3D},
    log::LogMsg,
};

use crate::{
    error::{RerunError, refused},
    geometry::{Bounds, along},
    plots::PLOTS,
    recorder::{APPLICATION, TIME},
};

/// From the centre of the scene to the camera, over the radius of the scene.
const EYE: [f32; 3] = [1.05, 0.85, 1.95];

/// Sends the layout.
pub(crate) fn send(stream: &RecordingStream, bounds: &Bounds) -> Result<(), RerunError> {
    let scene: ContainerLike = Spatial3DView::new("Cloth").with_origin("world").into();
    let ContainerLike::View(view) = &scene else { unreachable!("a 3D view is a view") };
    let view_path = view.blueprint_path();
    let plots = PLOTS.iter().map(|plot| TimeSeriesView::new(plot.title).with_origin(plot.path).into());
    let plots = Vertical::new(plots).into();
    let blueprint = Blueprint::new(Horizontal::new([scene, plots]).with_column_shares([3.0, 1.0]))
        .with_auto_views(false)
        .with_auto_layout(false)
        .with_blueprint_panel(BlueprintPanel::from_state(PanelState::Collapsed))
        .with_selection_panel(SelectionPanel::from_state(PanelState::Collapsed))
        .with_time_panel(TimePanel::new().with_state(PanelState::Collapsed).with_timeline(TIME));
    send_with_eye(stream, &blueprint, &view_path, bounds).map_err(refused("the layout"))
}

/// The SDK's layout types have no camera yet: its message is added to those of the layout, before the one that
/// makes the layout active.
fn send_with_eye(
    stream: &RecordingStream,
    blueprint: &Blueprint,
    view: &EntityPath,
    bounds: &Bounds,
) -> rerun::RecordingStreamResult<()> {
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
    let target = bounds.center();
    let eye = EyeControls3D::new()
        .with_position(along(target, bounds.radius(), EYE))
        .with_look_target(target)
        .with_eye_up([0.0, 1.0, 0.0]);
    extra.log(view.join(&"EyeControls3D".into()), &eye)?;
    extra.log(view.join(&"Background".into()), &Background::new(BackgroundKind::GradientDark))?;
    extra.log(view.join(&"LineGrid3D".into()), &LineGrid3D::new().with_visible(false))?;
    let own = storage.take().into_iter().filter(|message| matches!(message, LogMsg::ArrowMsg(..)));
    messages.extend(own);
    stream.send_blueprint(messages, activation);
    Ok(())
}
