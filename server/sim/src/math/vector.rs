//! 3-vectors and 3 x 3 matrices in the precision of a state.

/// A vector of three components.
pub type Vec3<R> = nalgebra::Vector3<R>;

/// A 3 x 3 matrix.
pub type Mat3<R> = nalgebra::Matrix3<R>;
