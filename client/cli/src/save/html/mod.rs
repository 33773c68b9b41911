//! One HTML file that any browser opens, without a server and without a network: a page, and the frames that it shows.
//!
//! It is written as frames come, beside its name. Cut anywhere, it still opens and shows its whole blocks.

mod head;
mod block;

use std::path::Path;

use nappe_client::{Frame, SessionEnd, Topology, Vectors, WatchOptions, holds_snow, packed::Step, v1};
use nappe_scene::printable;
use serde_json::{Value, json};

use self::{
    block::Block,
    head::{About, head},
};
use crate::{
    files::{aside::Growing, write::Existing},
    options::fields::{ColorName, FieldsArgs},
    words::{
        error::{CliError, Result},
        output, session,
    },
};

/// The page that shows what follows it; it ends with its own script, so that data can follow.
const PAGE: &str = include_str!("../../../../../viewer/web/dist/replay.html");
/// The extent of the first frame over the error that is allowed where nobody said one.
const FINENESS: f64 = 16_384.0;
/// The error that is allowed where the first frame has no extent (m).
const ERROR_OF_A_POINT: f64 = 1e-4;
/// A file larger than this is told how it gets smaller (bytes).
const LARGE: u64 = 200_000_000;

/// An HTML file in the making.
pub(crate) struct Html {
    file: Growing,
    fields: FieldsArgs,
    about: About,
    color: Option<ColorName>,
    /// Until the first frame, which tells how large the scene is.
    topology: Option<Topology>,
    /// The step of the positions, from the first frame on: the error allows it, and all particles are in its reach.
    step: Option<Step>,
    /// How often the step grew.
    coarser: u64,
    block: Option<Block>,
    frame_count: u64,
    last_step: u64,
}

impl Html {
    /// Opens the file, beside one that is there.
    ///
    /// # Errors
    /// When it cannot be opened, or is there and stays.
    pub(super) fn create(
        path: &Path,
        existing: Existing,
        fields: &FieldsArgs,
        scene: Option<&str>,
    ) -> Result<Self> {
        Ok(Self {
            file: Growing::open(path, existing)?,
            fields: fields.clone(),
            about: About { scene: scene.map(str::to_owned), ..About::default() },
            color: None,
            topology: None,
            step: None,
            coarser: 0,
            block: None,
            frame_count: 0,
            last_step: 0,
        })
    }

    /// These watch options with what the colour needs; notes what the session is.
    pub(super) fn watch(&mut self, mut options: WatchOptions, session: &v1::Session) -> WatchOptions {
        let title = if session.title.is_empty() { &session.session_id } else { &session.title };
        self.about.title = printable(title).into_owned();
        self.about.dt_seconds = session.dt_seconds;
        self.about.precision = session.precision().word();
        let of_snow = holds_snow(session).then_some(ColorName::PlasticRatio);
        self.color = self.fields.color().or(of_snow);
        if let Some(field) = self.color.and_then(ColorName::field) {
            options.fields = options.fields.with(field);
        }
        options
    }

    /// Keeps the topology for the head of the file.
    pub(super) fn topology(&mut self, topology: Topology) {
        self.topology = Some(topology);
    }

    /// Packs a frame, and writes the block that it ends.
    ///
    /// # Errors
    /// When the file cannot be written, or a particle is where no step reaches.
    pub(super) fn frame(&mut self, frame: &Frame) -> Result<()> {
        let step = match self.step {
            Some(step) => step,
            None => self.begin(frame)?,
        };
        let mut block = self.block.take().unwrap_or_else(|| Block::new(step, self.color));
        while block.add(frame).is_err() {
            let coarser = Step::new(block.step().exponent() + 1)
                .ok_or_else(|| CliError::failure("a particle is farther away than an HTML file can hold"))?;
            self.write_block(&block)?;
            block = Block::new(coarser, self.color);
        }
        if block.step() != step {
            self.step = Some(block.step());
            self.note_coarser(frame.frame, block.step());
        }
        (self.frame_count, self.last_step) = (self.frame_count + 1, frame.step);
        if block.is_whole() {
            self.write_block(&block)?;
        } else {
            self.block = Some(block);
        }
        Ok(())
    }

    /// Writes what is left and how the session ended or why it failed, if it did; then gives the file its name.
    ///
    /// # Errors
    /// When the file cannot be written.
    pub(super) fn finish(mut self, end: Option<SessionEnd>, failure: Option<&v1::Failure>) -> Result<()> {
        self.tell_coarser();
        if let Some(topology) = self.topology.take() {
            self.write_head(&topology, self.fields.max_error())?;
        }
        if self.file.bytes() == 0 {
            return Ok(());
        }
        if let Some(block) = self.block.take() {
            self.write_block(&block)?;
        }
        let end = json!({
            "frames": self.frame_count,
            "steps": end.map_or(self.last_step, |end| end.step),
            "hash": end.map(|end| output::hash(end.state_hash)),
            "finished": end.is_some(),
            "failure": failure.map(failed),
        });
        self.write_element("nappe-end", &end)?;
        self.file.finish()
    }

    /// Writes the head, for which the first frame says how large the scene is, and gives the step of the positions.
    fn begin(&mut self, frame: &Frame) -> Result<Step> {
        let bound = self.fields.max_error().unwrap_or_else(|| match extent(&frame.positions) {
            extent if extent > 0.0 => extent / FINENESS,
            _ => ERROR_OF_A_POINT,
        });
        let step = Step::within(bound)
            .ok_or_else(|| CliError::failure(format!("no HTML file holds positions within {bound} m")))?;
        if let Some(topology) = self.topology.take() {
            self.write_head(&topology, Some(step.bound()))?;
        }
        self.step = Some(step);
        Ok(step)
    }

    /// Writes the page and the head.
    fn write_head(&mut self, topology: &Topology, bound: Option<f64>) -> Result<()> {
        let color = self.color.and_then(ColorName::shown);
        let head = head(&self.about, topology, color, bound)?;
        self.file.write(PAGE.as_bytes())?;
        self.write_element("nappe-head", &head)
    }

    /// Says that positions are kept less finely from a frame on, the first time that it happens.
    fn note_coarser(&mut self, frame: u64, step: Step) {
        self.coarser += 1;
        if self.coarser == 1 {
            output::note(&format!(
                "nappe: from frame {frame} on, {} holds positions within {} m: the scene reaches too far for less",
                self.file.path().display(),
                step.bound()
            ));
        }
    }

    /// Says how coarse they have become, if that happened again.
    fn tell_coarser(&self) {
        if let (Some(step), 2..) = (self.step, self.coarser) {
            output::note(&format!(
                "nappe: the bound of positions in {} grew {} times, to {} m",
                self.file.path().display(),
                self.coarser,
                step.bound()
            ));
        }
    }

    /// Writes a block, unless it is empty, so that all of it is in the file.
    fn write_block(&mut self, block: &Block) -> Result<()> {
        if block.is_empty() {
            return Ok(());
        }
        let was_large = self.file.bytes() > LARGE;
        self.write_element("nappe-block", &block.json())?;
        self.file.flush()?;
        if self.file.bytes() > LARGE && !was_large {
            output::note(&format!(
                "nappe: {} has more than {} MB and grows: a larger --max-error, a longer --frame-interval or fewer --steps make it smaller",
                self.file.path().display(),
                LARGE / 1_000_000
            ));
        }
        Ok(())
    }

    /// Writes an element of data. No text within can end it.
    fn write_element(&mut self, class: &str, value: &Value) -> Result<()> {
        let text = value.to_string().replace('<', "\\u003c");
        let element = format!("<script type=\"application/json\" class=\"{class}\">{text}</script>\n");
        self.file.write(element.as_bytes())
    }
}

/// Why a session failed, as the file has it.
fn failed(failure: &v1::Failure) -> Value {
    json!({
        "reason": failure.reason,
        "message": printable(&failure.message),
        "diverged": session::diverged(failure),
        "step": failure.step,
        "time": failure.time_seconds,
        "particle": failure.particle,
        "value": failure.value,
    })
}

/// The longest side of the box around all particles (m).
fn extent(positions: &Vectors) -> f64 {
    let flat = positions.to_f32();
    let (points, _) = flat.as_chunks::<3>();
    let side = |axis: usize| {
        let along = points.iter().map(|point| f64::from(point[axis]));
        let (least, most) = along.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), coordinate| {
            (least.min(coordinate), most.max(coordinate))
        });
        most - least
    };
    (0..3).map(side).fold(0.0, f64::max)
}
