//! Lists that begin as zeros, and cost memory where they are written: a rank writes its own rows and what neighbours
//! compute of them.

use bytemuck::{Zeroable, zeroed_vec};

/// A list of zeros. The system hands them out page by page, as they are written.
pub(crate) fn zeroed<T: Zeroable>(len: usize) -> Vec<T> {
    zeroed_vec(len)
}

/// Makes a list as long as it is to be: of zeros, where it was not.
pub(crate) fn size<T: Zeroable>(list: &mut Vec<T>, len: usize) {
    if list.len() != len {
        *list = zeroed(len);
    }
}
