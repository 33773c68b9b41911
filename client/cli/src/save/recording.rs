//! A Rerun recording; in a build without Rerun, a type that has no values.

#[cfg(feature = "rerun")]
pub(super) use with_rerun::Recording;
#[cfg(not(feature = "rerun"))]
pub(super) use without_rerun::Recording;

#[cfg(feature = "rerun")]
mod with_rerun {
    use std::path::Path;

    use nappe_client::{Frame, Topology};
    use nappe_rerun::{Recorder, Sink};

    use crate::{
        contents::ColorName,
        error::{CliError, Result},
    };

    /// An open recording.
    pub(in crate::save) struct Recording(Recorder);

    impl Recording {
        /// Opens the file.
        pub(in crate::save) fn create(path: &Path, color: ColorName) -> Result<Self> {
            let title = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            Recorder::open(&title, Sink::Save(path.to_owned()), color.into())
                .map(Self)
                .map_err(CliError::failure)
        }

        /// Records the topology.
        pub(in crate::save) fn topology(&mut self, topology: &Topology) -> Result<()> {
            self.0.topology(topology).map_err(CliError::failure)
        }

        /// Records a frame.
        pub(in crate::save) fn frame(&mut self, frame: &Frame) -> Result<()> {
            self.0.frame(frame).map_err(CliError::failure)
        }

        /// Closes the file.
        pub(in crate::save) fn finish(self) -> Result<()> {
            self.0.finish().map_err(CliError::failure)
        }
    }
}

#[cfg(not(feature = "rerun"))]
mod without_rerun {
    use std::path::Path;

    use nappe_client::{Frame, Topology};

    use crate::{
        contents::ColorName,
        error::{CliError, Result},
    };

    /// There is none.
    pub(in crate::save) enum Recording {}

    impl Recording {
        /// A refusal.
        pub(in crate::save) fn create(path: &Path, _: ColorName) -> Result<Self> {
            Err(CliError::usage(format!("--save {}: this build cannot write Rerun recordings", path.display()))
                .hint("give a folder for PLY meshes, or build nappe with its feature `rerun`, which is on by default"))
        }

        /// Never called.
        pub(in crate::save) fn topology(&mut self, _: &Topology) -> Result<()> {
            match *self {}
        }

        /// Never called.
        pub(in crate::save) fn frame(&mut self, _: &Frame) -> Result<()> {
            match *self {}
        }

        /// Never called.
        pub(in crate::save) fn finish(self) -> Result<()> {
            match self {}
        }
    }
}
