//! The tasks of a step of cloth, each done by itself: what steps do together, to be timed one by one.

/// A task of a step of cloth (Zara 2001, section 6).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Task {
    /// What the others need and no step does: copies of the state, and room.
    Room,
    /// The forces on all particles, with the energies that an evaluation tells.
    Force,
    /// Forces to accelerations.
    Acceleration,
    /// Accelerations to new velocities.
    Velocity,
    /// New velocities to new positions.
    Position,
    /// Of an implicit step: the forces again, with the matrix. What that takes longer than the forces alone is the time of
    /// the matrix.
    ForceAndMatrix,
    /// Of an implicit step: solving for the change of velocity.
    Solve,
}

impl Task {
    /// Every task, in the order in which they are done.
    pub const ALL: [Self; 7] = [
        Self::Room,
        Self::Force,
        Self::Acceleration,
        Self::Velocity,
        Self::Position,
        Self::ForceAndMatrix,
        Self::Solve,
    ];
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tasks_are_numbered_in_the_order_of_their_list() {
        for (place, task) in Task::ALL.into_iter().enumerate() {
            assert_eq!(task as usize, place);
        }
    }
}
