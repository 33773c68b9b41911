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
        error::{CliError, Result},
        fields::ColorName,
    };

    /// An open recording.
    pub(crate) struct Recording(Recorder);

    impl Recording {
        /// Opens the file.
        pub(crate) fn create(path: &Path, color: ColorName) -> Result<Self> {
            let title = path.file_stem().map_or_else(String::new, |stem| stem.to_string_lossy().into_owned());
            Recorder::open(&title, Sink::Save(path.to_owned()), color.into())
                .map(Self)
                .map_err(CliError::failure)
        }

        /// Records the topology.
        pub(crate) fn topology(&mut self, topology: &Topology) -> Result<()> {
            self.0.topology(topology).map_err(CliError::failure)
        }

        /// Records a frame.
        pub(crate) fn frame(&mut self, frame: &Frame) -> Result<()> {
            self.0.frame(frame).map_err(CliError::failure)
        }

        /// Closes the file.
        pub(crate) fn finish(self) -> Result<()> {
            self.0.finish().map_err(CliError::failure)
        }
    }
}

#[cfg(not(feature = "rerun"))]
mod without_rerun {
    use std::path::Path;

    use nappe_client::{Frame, Topology};

    use crate::{
        error::{CliError, Result},
        fields::ColorName,
    };

    /// A recording, which this build cannot make: the type has no values.
    pub(crate) enum Recording {}

    impl Recording {
        /// Refuses: this build cannot record.
        pub(crate) fn create(path: &Path, _: ColorName) -> Result<Self> {
            Err(CliError::usage(format!("--save {}: this build cannot write Rerun recordings", path.display()))
                .hint("give a folder for PLY meshes, or build nappe with its feature `rerun`, which is on by default"))
        }

        pub(crate) fn topology(&mut self, _: &Topology) -> Result<()> {
            match *self {}
        }

        pub(crate) fn frame(&mut self, _: &Frame) -> Result<()> {
            match *self {}
        }

        pub(crate) fn finish(self) -> Result<()> {
            match self {}
        }
    }
}
