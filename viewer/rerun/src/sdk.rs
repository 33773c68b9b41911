//! The names of the Rerun SDK that this crate uses, from the crates that own them.

pub(crate) use re_log_encoding::{Decodable, StreamFooter};
pub(crate) use re_sdk::{
    AsComponents, DEFAULT_CONNECT_URL, EntityPath, RecordingStream, RecordingStreamBuilder,
    RecordingStreamError, RecordingStreamResult, SpawnError, SpawnOptions, log::LogMsg,
};
pub(crate) use re_sdk_types::{
    archetypes::{
        Arrows3D, Boxes3D, Capsules3D, Cylinders3D, Ellipsoids3D, Image, LineStrips3D, Mesh3D, Points3D,
        Scalars, SeriesLines, StateChange, TextLog, Transform3D, ViewCoordinates,
    },
    components::{Color, FillMode, Radius, TextLogLevel},
};

/// What a viewer shows, and where.
pub(crate) mod blueprint {
    pub(crate) use re_sdk::blueprint::*;
    pub(crate) use re_sdk_types::blueprint::archetypes::{Background, EyeControls3D, LineGrid3D, PlotLegend};
}
