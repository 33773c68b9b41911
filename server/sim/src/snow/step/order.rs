//! The order of particles: renewed after a step, or made from nothing.
//!
//! Reads where particles are, or where they went; writes the sorted order, the blocks of the grid,
//! and now and then the places of the particles.

use crate::{
    math::Real,
    snow::{
        grid::{ROOM, key_and_cell, within_reach},
        model::SnowModel,
        particles::Particles,
        ranks::{Found, SnowRanks},
        state::SnowWorkspace,
        transfer::weights,
    },
};

/// Sorts from nothing what is here; a particle out of reach is left to [`lost`](super::failure::lost).
pub(crate) fn sort_anew<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    work: &mut SnowWorkspace<R>,
) {
    if work.divided().is_some() {
        let places: Vec<u32> = work.sorter.places().collect();
        sort_places(model, particles, places.into_iter(), work);
    } else {
        sort_places(model, particles, 0..particles.len() as u32, work);
        work.grid.link(model.settings.periodic);
    }
    make_room(work);
}

/// The first node of the particle at a place, where it is within reach.
fn first_node<R: Real>(model: &SnowModel<R>, particles: &Particles<R>, place: u32) -> [i32; 3] {
    let inverse_cell = R::of(1.0 / model.settings.cell);
    particles.x(place as usize).map(|x| weights(model.settings.kernel, x * inverse_cell).0)
}

/// Sorts the particles at some places from nothing; blocks are not linked then.
fn sort_places<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    places: impl Iterator<Item = u32>,
    work: &mut SnowWorkspace<R>,
) {
    let settings = &model.settings;
    let node = |place: u32| {
        let node = first_node(model, particles, place);
        (place, node.map(|node| if within_reach(node) { node } else { 0 }))
    };
    work.sorter.rebuild(places.map(node), &particles.id, &mut work.grid, settings.periodic);
    work.culprits = None;
}

/// Room for more blocks than there are.
fn make_room<R: Real>(work: &mut SnowWorkspace<R>) {
    let spare = work.grid.blocks.len() + ROOM;
    work.sorter.reserve(spare);
    work.grid.reserve(spare);
    work.chunk_diagnostics.reserve(spare);
    work.partials.reserve(spare);
    work.block_given.reserve(spare);
    work.block_diagnostics.reserve(8 * spare);
    if let Some(ranks) = work.ranks.as_ref().filter(|ranks| ranks.is_divided()) {
        work.sorter.reserve_places(ranks.place_of.len());
    }
}

/// Puts particles in the sorted order, so that those of a block lie together again.
pub(crate) fn renew_places<R: Real>(particles: &mut Particles<R>, work: &mut SnowWorkspace<R>) {
    let SnowWorkspace { sorter, spare, ranks, .. } = work;
    let Some(ranks) = ranks.as_mut().filter(|ranks| ranks.is_divided()) else {
        particles.permute(&sorter.order, spare);
        sorter.renumber(&mut particles.id, &mut particles.object);
        return;
    };
    // Those of others come after own ones.
    let SnowRanks { order, is_own, place_of, .. } = &mut *ranks;
    is_own.clear();
    is_own.resize(particles.len(), false);
    for place in &sorter.order {
        is_own[*place as usize] = true;
    }
    order.clear();
    order.extend_from_slice(&sorter.order);
    order.extend((0..particles.len() as u32).filter(|place| !is_own[*place as usize]));
    particles.permute(order, spare);
    // By way of a list that is written anew below.
    for (number, place) in place_of.iter_mut().zip(&*order) {
        *number = particles.id[*place as usize];
    }
    particles.id.copy_from_slice(place_of);
    for (number, place) in place_of.iter_mut().zip(&*order) {
        *number = particles.object[*place as usize].into();
    }
    for (object, number) in particles.object.iter_mut().zip(&*place_of) {
        *object = *number as u16;
    }
    (0..).zip(&mut sorter.order).for_each(|(place, own)| *own = place);
    sorter.moved = 0;
    ranks.find_places(&particles.id);
}

/// Gives each of several ranks its part, before the first step.
pub(crate) fn divide<R: Real>(model: &SnowModel<R>, particles: &Particles<R>, work: &mut SnowWorkspace<R>) {
    let Some(ranks) = work.ranks.as_mut().filter(|ranks| !ranks.is_divided()) else { return };
    ranks.cut(&work.grid.blocks, &work.sorter.starts);
    ranks.find_places(&particles.id);
    work.grid.own_keys = ranks.own_keys();
    let sorted = work.sorter.sorted();
    let own = (0..).zip(&work.grid.blocks).filter(|(_, key)| work.grid.own_keys.contains(key));
    let places: Vec<u32> = own.flat_map(|(block, _)| sorted.places(block)).copied().collect();
    sort_places(model, particles, places.into_iter(), work);
    meet(model, work);
    make_room(work);
    let found =
        Found { blocks: work.grid.blocks.len(), nodes: work.grid.own_nodes.len(), ..Found::default() };
    if let Some(ranks) = &mut work.ranks {
        ranks.count(&found, &[], |_| {});
    }
}

/// Links blocks, those of others included that are needed here.
fn meet<R: Real>(model: &SnowModel<R>, work: &mut SnowWorkspace<R>) {
    let SnowWorkspace { ranks, grid, sorter, .. } = work;
    let periodic = model.settings.periodic;
    let others_changed = ranks.as_mut().is_some_and(|ranks| ranks.meet(grid, periodic));
    if sorter.has_changed || others_changed {
        grid.link(periodic);
    }
}

/// Hands particles over that went to blocks of other ranks, and takes in those that come.
fn trade<R: Real>(model: &SnowModel<R>, particles: &mut Particles<R>, work: &mut SnowWorkspace<R>) {
    let SnowWorkspace { ranks, grid, sorter, .. } = work;
    let (Some(ranks), periodic) = (ranks, model.settings.periodic) else { return };
    let mut post = std::mem::take(&mut ranks.post);
    post.clear(ranks.ranks.size_and_rank().0);
    let hand_over = |place: u32, key: u64| particles.pack(place as usize, post.sent_to(ranks.owner(key)));
    if sorter.has_followed() {
        sorter.let_go(grid, periodic, hand_over);
    } else {
        let key = |place: u32| {
            let node = first_node(model, particles, place);
            node.iter().all(|node| within_reach(*node)).then(|| key_and_cell(node, periodic).0)
        };
        sorter.let_far_go(grid, key, hand_over);
    }
    post.swap(&ranks.ranks);
    for bytes in post.received() {
        for one in bytes.chunks_exact(Particles::<R>::PACKED) {
            let place = particles.unpack(one, &ranks.place_of) as u32;
            sorter.take_in(place, first_node(model, particles, place), periodic);
        }
    }
    ranks.post = post;
}

/// The order after a step; false where a particle went further than a block, and all were sorted
/// anew.
pub(crate) fn renew_order<R: Real>(
    model: &SnowModel<R>,
    particles: &mut Particles<R>,
    work: &mut SnowWorkspace<R>,
) -> bool {
    work.sorter.begin(&work.grid, model.settings.periodic);
    trade(model, particles, work);
    let followed = work.sorter.has_followed();
    if followed {
        work.sorter.renew(&particles.id, &mut work.grid, model.settings.periodic);
        meet(model, work);
    } else {
        sort_anew(model, particles, work);
        if work.divided().is_some() {
            meet(model, work);
        }
    }
    if 4 * work.sorter.moved > work.sorter.order.len() {
        renew_places(particles, work);
    }
    followed
}
