//! What Zara measured in 2001, to stand beside our own figures.
//!
//! Seconds a frame of an unspecified mesh of that many particles. The machines were a cluster of
//! Pentium III at 733 MHz and a shared-memory machine with four Pentium Pro at 200 MHz.

use serde::Serialize;

use super::zara::Scheme;

/// What a figure was measured on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Machine {
    /// One processor of the cluster.
    OneProcessor,
    /// Ten processors of the cluster.
    TenProcessorCluster,
    /// The cluster; the table at hand does not say how many processors.
    Cluster,
    /// One thread of the shared-memory machine.
    OneThreadSmp,
    /// Four threads of the shared-memory machine.
    FourThreadSmp,
}

impl Machine {
    /// For a column.
    pub(crate) const fn label(self) -> &'static str {
        match self {
            Self::OneProcessor => "1 processor",
            Self::TenProcessorCluster => "cluster, 10 processors",
            Self::Cluster => "cluster",
            Self::OneThreadSmp => "SMP, 1 thread",
            Self::FourThreadSmp => "SMP, 4 threads",
        }
    }
}

/// A figure of the paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct Figure {
    /// What it was measured on.
    pub(crate) machine: Machine,
    /// Seconds a frame.
    pub(crate) seconds: f64,
}

const fn figure(machine: Machine, seconds: f64) -> Figure {
    Figure { machine, seconds }
}

/// The paper's figures for a scheme and a number of particles; none where it gives none.
pub(crate) fn figures(scheme: Scheme, particles: usize) -> Vec<Figure> {
    use Machine::{Cluster, FourThreadSmp, OneProcessor, OneThreadSmp, TenProcessorCluster};
    match (scheme, particles) {
        (Scheme::Implicit, 2_500) => vec![figure(OneProcessor, 2.70), figure(TenProcessorCluster, 2.75)],
        (Scheme::Implicit, 10_000) => vec![figure(OneProcessor, 11.46), figure(TenProcessorCluster, 11.9)],
        (Scheme::Implicit, 22_500) => vec![figure(OneProcessor, 32.0), figure(TenProcessorCluster, 35.3)],
        (Scheme::Implicit, 160_000) => vec![figure(OneThreadSmp, 125.0), figure(FourThreadSmp, 221.0)],
        (Scheme::Explicit, 122_500) => vec![figure(OneProcessor, 13.0), figure(Cluster, 1.51)],
        _ => Vec::new(),
    }
}
