//! Records topology and frames, in the calling thread.
//!
//! Enters: `Topology`, then `Frame`s. Leaves: a recording file or data in a viewer. The SDK blocks its producer
//! when the consumer is slow, so that a file holds every frame; for a live viewer see `live`.

use std::{
    error::Error,
    fs::File,
    io::{Read as _, Seek as _, SeekFrom},
    path::{Path, PathBuf},
    time::{Duration, Instant},
};

use nappe_client::{Frame, Topology, v1};

use crate::{
    arrows::ForceArrows,
    body::BodyView,
    camera::Camera,
    collider::ColliderView,
    coloring::{ColorBy, Coloring},
    error::{RerunError, refused},
    full::why_unwritten,
    geometry::Bounds,
    grid::GridView,
    layout::{self, APPLICATION, BodyKinds, TIME},
    loads,
    lock::lock,
    particle_arrows::ParticleArrows,
    plots::{self, CLOTH, GENERAL},
    sdk::{
        Color, Decodable as _, RecordingStream, RecordingStreamBuilder, RecordingStreamError, SpawnError,
        SpawnOptions, StreamFooter, ViewCoordinates,
    },
    snow_plots::{BoundLog, SNOW},
};

/// The timeline of steps.
const STEP: &str = "step";
/// Longest time that a viewer may take to answer.
const VIEWER_LIMIT: Duration = Duration::from_secs(10);
/// Time between two looks at whether a file takes what it is given: the SDK goes on without a word when it does not.
const LOOK_INTERVAL: Duration = Duration::from_secs(1);

/// Where a recording goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Sink {
    /// A file, by custom with the extension `.rrd`.
    Save(PathBuf),
    /// A viewer that is running, for example at `rerun+http://127.0.0.1:9876/proxy`.
    Connect(String),
    /// A viewer on this machine, started unless one is running.
    Spawn,
}

/// A recording in the making.
pub struct Recorder {
    stream: RecordingStream,
    sink: Sink,
    /// Keeps other recordings from the file.
    _lock: Option<File>,
    coloring: Coloring,
    scene: Option<SceneView>,
    kept: Kept,
}

/// How many frames were recorded, and how many of them are surely in the file.
struct Kept {
    frames: u64,
    in_file: u64,
    /// When the file was looked at.
    looked: Instant,
}

struct SceneView {
    particle_count: usize,
    bodies: Vec<BodyView>,
    colliders: Vec<ColliderView>,
    grid: GridView,
    bound: BoundLog,
    /// Wait for the first frame, too: those of colliders, and those of particles.
    arrows: Option<ForceArrows>,
    particle_arrows: Option<ParticleArrows>,
    /// The camera, the shapes of planes and the layout wait for the first frame, which tells how large the scene is;
    /// if snow shows only later, the layout is sent again.
    layout: Option<SentLayout>,
}

/// The layout that was sent with the first frame.
#[derive(Clone, Copy)]
struct SentLayout {
    camera: Camera,
    kinds: BodyKinds,
}

impl Recorder {
    /// Opens a recording called `title`, in which the colour of snow shows `color_by`, where frames hold that.
    ///
    /// # Errors
    /// If the file cannot be created, no viewer answers, or none can be started.
    pub fn open(title: &str, sink: Sink, color_by: ColorBy) -> Result<Self, RerunError> {
        let builder = RecordingStreamBuilder::new(APPLICATION).recording_name(title);
        let lock = match &sink {
            Sink::Save(path) => lock(path)?,
            Sink::Connect(_) | Sink::Spawn => None,
        };
        let stream = match &sink {
            Sink::Save(path) => builder.save(path).map_err(|error| file_error(path, &error, ""))?,
            Sink::Connect(url) => {
                let refuse = |cause: String| RerunError::Connect { url: url.clone(), cause };
                let stream =
                    builder.connect_grpc_opts(url.as_str()).map_err(|error| refuse(error.to_string()))?;
                reach(&stream).map_err(refuse)?;
                stream
            }
            Sink::Spawn => spawn(builder)?,
        };

        // The two timelines that count are those of the simulation.
        stream.set_log_tick_enabled(false);
        stream.set_log_time_enabled(false);
        stream.log_static("world", &ViewCoordinates::RIGHT_HAND_Y_UP()).map_err(refused("world"))?;
        plots::describe(&stream, &GENERAL)?;
        let kept = Kept { frames: 0, in_file: 0, looked: Instant::now() };
        Ok(Self { stream, sink, _lock: lock, coloring: Coloring::new(color_by), scene: None, kept })
    }

    /// Records what does not change: meshes, pins, colliders.
    ///
    /// # Errors
    /// If the SDK refuses the data.
    pub fn topology(&mut self, topology: &Topology) -> Result<(), RerunError> {
        let scene = SceneView {
            particle_count: topology.particle_count,
            bodies: topology.bodies.iter().enumerate().map(|(i, body)| BodyView::new(body, i)).collect(),
            colliders: topology
                .colliders
                .iter()
                .enumerate()
                .filter_map(|(i, c)| ColliderView::new(c, i))
                .collect(),
            grid: GridView::default(),
            bound: BoundLog::default(),
            arrows: None,
            particle_arrows: None,
            layout: None,
        };
        for body in &scene.bodies {
            body.describe(&self.stream)?;
        }
        loads::describe(&self.stream, &topology.colliders)?;
        self.scene = Some(scene);
        Ok(())
    }

    /// Records a frame, on the timelines `step` and `time`.
    ///
    /// # Errors
    /// If the frame has not as many particles as the topology, a position is not finite, the SDK refuses the data, or
    /// the file took no more than earlier frames.
    pub fn frame(&mut self, frame: &Frame) -> Result<(), RerunError> {
        self.log_frame(frame)?;
        self.kept.frames += 1;
        if self.kept.looked.elapsed() >= LOOK_INTERVAL {
            self.flush_file()?;
        }
        Ok(())
    }

    /// Has the file take what it was given so far, if there is a file.
    fn flush_file(&mut self) -> Result<(), RerunError> {
        if let Sink::Save(path) = &self.sink {
            self.stream.flush_blocking().map_err(|error| file_error(path, &error, &self.kept.told()))?;
        }
        self.kept = Kept { in_file: self.kept.frames, looked: Instant::now(), ..self.kept };
        Ok(())
    }

    fn log_frame(&mut self, frame: &Frame) -> Result<(), RerunError> {
        let (found, expected) =
            (frame.positions.len(), self.scene.as_ref().map_or(0, |scene| scene.particle_count));
        let Some(scene) = self.scene.as_mut().filter(|_| found == expected) else {
            return Err(RerunError::Frame { frame: frame.frame, found, expected });
        };
        let flat = frame.positions.to_f32();
        if let Some(at) = flat.iter().position(|coordinate| !coordinate.is_finite()) {
            return Err(RerunError::NotFinite { frame: frame.frame, particle: at / 3 });
        }
        let (points, _) = flat.as_chunks::<3>();
        let colors = if scene.has_points() { self.coloring.of(frame) } else { None };
        let colors = colors.as_deref().filter(|colors| colors.len() == points.len());

        scene.log_static(&self.stream, points, colors, frame.diagnostics.as_ref())?;
        self.stream.set_time_sequence(STEP, i64::try_from(frame.step).unwrap_or(i64::MAX));
        self.stream.set_duration_secs(TIME, frame.time);
        for body in &scene.bodies {
            body.log(&self.stream, points, colors)?;
        }
        for collider in &mut scene.colliders {
            collider.log(&self.stream, frame)?;
        }
        if let Some(arrows) = &mut scene.arrows {
            arrows.log(&self.stream, &scene.colliders, frame)?;
        }
        if let Some(arrows) = &mut scene.particle_arrows {
            arrows.log(&self.stream, points, frame)?;
        }
        if let Some(grid) = &frame.grid {
            scene.grid.log(&self.stream, grid)?;
        }
        match &frame.diagnostics {
            Some(diagnostics) => scene.log_diagnostics(&self.stream, diagnostics),
            None => Ok(()),
        }
    }

    /// Sends what is left and closes the recording.
    ///
    /// # Errors
    /// If the file is not complete, or the viewer does not take the rest within 10 s.
    pub fn finish(mut self) -> Result<(), RerunError> {
        self.flush_file()?;
        match &self.sink {
            Sink::Save(path) => {
                // Closes the file: its end is written only now.
                self.stream.disconnect();
                check_end(path).map_err(|error| file_error(path, &*error, &self.kept.told()))
            }
            Sink::Connect(_) | Sink::Spawn => self
                .stream
                .flush_with_timeout(VIEWER_LIMIT)
                .map_err(|_late| RerunError::Stalled { seconds: VIEWER_LIMIT.as_secs_f64() }),
        }
    }
}

impl Kept {
    /// They, as the end of a message.
    fn told(&self) -> String {
        format!("; of {} frames that came, the first {} are surely in it", self.frames, self.in_file)
    }
}

impl SceneView {
    /// True if a body is made of bare points, as snow is.
    fn has_points(&self) -> bool {
        self.bodies.iter().any(BodyView::is_points)
    }

    /// Logs, once, what depends on the size of the scene: points, colliders, arrows and the layout with its camera. The
    /// layout comes again when snow shows for the first time.
    fn log_static(
        &mut self,
        stream: &RecordingStream,
        points: &[[f32; 3]],
        colors: Option<&[Color]>,
        diagnostics: Option<&v1::Diagnostics>,
    ) -> Result<(), RerunError> {
        let kinds = BodyKinds {
            has_cloth: self.bodies.iter().any(|body| !body.is_points()),
            has_snow: self.has_points() || diagnostics.is_some_and(|step| step.snow.is_some()),
            has_colliders: !self.colliders.is_empty(),
        };
        if let Some(sent) = &mut self.layout {
            if kinds.has_snow == sent.kinds.has_snow || !kinds.has_snow {
                return Ok(());
            }
            sent.kinds = kinds;
            plots::describe(stream, &SNOW)?;
            return layout::send(stream, sent.camera, kinds);
        }

        let [bounds, bodies] = self.bounds(points);
        let camera = Camera::of(&bounds, &bodies, &self.colliders);
        for body in &self.bodies {
            body.log_static(stream, points, colors)?;
        }
        for collider in &self.colliders {
            collider.describe(stream, &bounds, camera.eye)?;
        }
        let arrows = ForceArrows::new(&self.colliders, bounds.radius());
        arrows.describe(stream)?;
        self.arrows = Some(arrows);
        self.particle_arrows = Some(ParticleArrows::new(bounds.radius()));
        if kinds.has_cloth {
            plots::describe(stream, &CLOTH)?;
        }
        if kinds.has_snow {
            plots::describe(stream, &SNOW)?;
        }

        self.layout = Some(SentLayout { camera, kinds });
        layout::send(stream, camera, kinds)
    }

    /// Where bodies and colliders are, and where bodies that hang or fly freely can come to; and where bodies are.
    fn bounds(&self, points: &[[f32; 3]]) -> [Bounds; 2] {
        let mut bodies = Bounds::empty();
        for body in &self.bodies {
            body.add_to(&mut bodies, points);
        }
        let mut bounds = bodies;
        for collider in &self.colliders {
            collider.extent().add_to(&mut bounds, &bodies);
            if self.has_points() {
                collider.add_foot_to(&mut bounds, &bodies);
            }
        }
        [bounds, bodies]
    }

    /// Logs the diagnostics of a step at the stream's current time.
    fn log_diagnostics(
        &mut self,
        stream: &RecordingStream,
        diagnostics: &v1::Diagnostics,
    ) -> Result<(), RerunError> {
        plots::log(stream, diagnostics, &GENERAL)?;
        if self.layout.is_some_and(|sent| sent.kinds.has_cloth) {
            plots::log(stream, diagnostics, &CLOTH)?;
        }
        plots::log(stream, diagnostics, &SNOW)?;
        loads::log(stream, diagnostics)?;
        self.bound.log(stream, diagnostics)
    }
}

/// Starts a viewer on the loopback interface alone, or finds the one that is running.
fn spawn(builder: RecordingStreamBuilder) -> Result<RecordingStream, RerunError> {
    let options = SpawnOptions {
        wait_for_bind: true,
        hide_welcome_screen: true,
        // Its own default is every interface.
        extra_args: vec!["--bind=127.0.0.1".to_owned()],
        ..SpawnOptions::default()
    };
    let stream = builder.spawn_opts(&options).map_err(|error| match error {
        RecordingStreamError::SpawnViewer(
            SpawnError::ExecutableNotFoundInPath { .. } | SpawnError::ExecutableNotFound { .. },
        ) => RerunError::ViewerNotFound,
        other => RerunError::ViewerFailed { cause: other.to_string() },
    })?;
    reach(&stream).map_err(|cause| RerunError::ViewerFailed { cause })?;
    Ok(stream)
}

/// The SDK connects in the background: a flush tells whether somebody is there.
fn reach(stream: &RecordingStream) -> Result<(), String> {
    stream.flush_with_timeout(VIEWER_LIMIT).map_err(|error| error.to_string())
}

/// Why a file is not complete, with what is told of its frames.
fn file_error(path: &Path, error: &dyn Error, frames: &str) -> RerunError {
    let why = why_unwritten(path).unwrap_or_else(|| error.to_string());
    RerunError::File { path: path.to_owned(), cause: format!("{why}{frames}") }
}

/// The SDK only logs an error that it meets while it ends a file: look at the end itself.
fn check_end(path: &Path) -> Result<(), Box<dyn Error>> {
    let read = || -> std::io::Result<Vec<u8>> {
        let mut file = File::open(path)?;
        file.seek(SeekFrom::End(-i64::try_from(StreamFooter::ENCODED_SIZE_BYTES).unwrap_or(i64::MAX)))?;
        let mut end = Vec::new();
        file.read_to_end(&mut end)?;
        Ok(end)
    };
    StreamFooter::from_rrd_bytes(&read()?)?;
    Ok(())
}
