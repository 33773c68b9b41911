//! The gallery: every scene over every method that it concerns.

use nappe_sim::cloth::{Hessian, Integrator, Minimizer, NewtonSettings};
use rayon::prelude::*;

use super::{blocks, finding::Finding, motions, pieces, row::Row, squeezed, states, steps};
use crate::{
    method::{Method, Variant},
    run::Budget,
};

/// Scenes over methods of a kind.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// What its methods are.
    pub family: Family,
    /// Names of its methods, or of its transfers with their kernels.
    pub methods: Vec<String>,
    /// Scenes, by their numbers.
    pub scenes: Vec<Exhibit>,
}

/// What the methods of a table are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Explicit methods of cloth.
    Explicit,
    /// Implicit methods of cloth.
    Implicit,
    /// Implicit methods of cloth, on a sheet that is squeezed.
    Squeezed,
    /// Transfers of snow with kernels.
    Snow,
}

/// A scene of the gallery, and what becomes of every method in it.
#[derive(Clone, Debug, PartialEq)]
pub struct Exhibit {
    /// By which it is known.
    pub number: u32,
    /// What it is.
    pub what: &'static str,
    /// What becomes of each method.
    pub findings: Vec<Finding>,
}

/// All tables. `tell` is called with what is done now.
pub fn gallery(budget: &Budget, tell: &dyn Fn(&str)) -> Vec<Table> {
    let cloth = || steps::SCENES.into_iter().chain(states::SCENES).chain(motions::SCENES).collect::<Vec<_>>();
    tell("explicit methods of cloth");
    let explicit = table(Family::Explicit, &explicit(), Method::name, &cloth(), budget);
    tell("implicit methods of cloth");
    let implicit = implicit();
    let squeezed = table(Family::Squeezed, &implicit, Method::name, &squeezed::SCENES, budget);
    let implicit = table(Family::Implicit, &implicit, Method::name, &cloth(), budget);
    tell("snow");
    let scenes: Vec<_> = blocks::SCENES.into_iter().chain(pieces::SCENES).collect();
    let snow = table(Family::Snow, &Variant::per_step(), Variant::name, &scenes, budget);
    vec![explicit, implicit, squeezed, snow]
}

fn explicit() -> Vec<Method> {
    let all = Integrator::ALL.into_iter().filter(|integrator| !integrator.is_implicit());
    all.map(|integrator| Method::new(integrator, Hessian::Absolute)).collect()
}

fn implicit() -> Vec<Method> {
    let ways = [
        Minimizer::OneStep,
        Minimizer::Newton(NewtonSettings::default()),
        Minimizer::VertexBlockDescent { sweeps: Minimizer::DEFAULT_SWEEPS },
    ];
    let all = Integrator::ALL.into_iter().filter(|integrator| integrator.is_implicit());
    let of = |integrator| Method::new(integrator, Hessian::Absolute);
    all.flat_map(|integrator| ways.map(|minimizer| Method { minimizer, ..of(integrator) })).collect()
}

/// Scenes over methods, all cells side by side. What is left when the study is ended stays without a verdict.
fn table<M: Copy + Sync>(
    family: Family,
    methods: &[M],
    name: fn(M) -> String,
    rows: &[Row<M>],
    budget: &Budget,
) -> Table {
    let cells: Vec<(&Row<M>, M)> =
        rows.iter().flat_map(|row| methods.iter().map(move |method| (row, *method))).collect();
    let find = |&(row, method): &(&Row<M>, M)| {
        if budget.is_stopped() { Finding::NONE } else { (row.run)(method) }
    };
    let findings: Vec<Finding> = cells.par_iter().map(find).collect();
    let exhibit = |(row, findings): (&Row<M>, &[Finding])| Exhibit {
        number: row.number,
        what: row.what,
        findings: findings.to_vec(),
    };
    Table {
        family,
        methods: methods.iter().map(|method| name(*method)).collect(),
        scenes: rows.iter().zip(findings.chunks(methods.len())).map(exhibit).collect(),
    }
}
