//! The schemes of Zara 2001 and what she measured with them, to stand beside our own measurements.
//!
//! Seconds per frame of an unspecified mesh of that many particles. The machines were a cluster of
//! Pentium III at 733 MHz and a shared-memory machine with four Pentium Pro at 200 MHz.

use nappe_sim::cloth::Integrator;
use serde::Serialize;

/// How a step is taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scheme {
    /// Explicit Euler (section 3.2 of the paper).
    Explicit,
    /// Implicit Euler, ten iterations of the conjugate gradient from zero (algorithm 1).
    Implicit,
}

impl Scheme {
    /// Both schemes, in the order of the table.
    pub(crate) const ALL: [Self; 2] = [Self::Explicit, Self::Implicit];

    /// Its name in a row.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Explicit => "explicit",
            Self::Implicit => "implicit",
        }
    }

    /// The integrator of the library that takes such a step.
    pub(crate) const fn integrator(self) -> Integrator {
        match self {
            Self::Explicit => Integrator::ExplicitEuler,
            Self::Implicit => Integrator::ImplicitEuler,
        }
    }
}

/// What a time was measured on.
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

/// A time in the paper.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(crate) struct PublishedTime {
    /// What it was measured on.
    pub(crate) machine: Machine,
    /// Time per frame (s).
    pub(crate) seconds: f64,
}

const fn time(machine: Machine, seconds: f64) -> PublishedTime {
    PublishedTime { machine, seconds }
}

/// The paper's times of a scheme with a number of particles; none where it gives none.
pub(crate) fn published_times(scheme: Scheme, particles: usize) -> Vec<PublishedTime> {
    use Machine::{Cluster, FourThreadSmp, OneProcessor, OneThreadSmp, TenProcessorCluster};
    match (scheme, particles) {
        (Scheme::Implicit, 2_500) => vec![time(OneProcessor, 2.70), time(TenProcessorCluster, 2.75)],
        (Scheme::Implicit, 10_000) => vec![time(OneProcessor, 11.46), time(TenProcessorCluster, 11.9)],
        (Scheme::Implicit, 22_500) => vec![time(OneProcessor, 32.0), time(TenProcessorCluster, 35.3)],
        (Scheme::Implicit, 160_000) => vec![time(OneThreadSmp, 125.0), time(FourThreadSmp, 221.0)],
        (Scheme::Explicit, 122_500) => vec![time(OneProcessor, 13.0), time(Cluster, 1.51)],
        _ => Vec::new(),
    }
}
