//! Whether a file can be written any further: the SDK only tells that its writer has ended.

use std::{
    fs::File,
    io::{self, Write as _},
    path::Path,
};

/// Bytes that are tried: a full disk may still have room in the last block of a file.
const TRIED: usize = 1 << 20;

/// Why a file takes nothing more; none if it does. What is tried is taken away again.
pub(crate) fn why_unwritten(path: &Path) -> Option<String> {
    let error = try_to_write(path).err()?;
    let is_full = error.kind() == io::ErrorKind::StorageFull;
    Some(if is_full { format!("the disk is full ({error})") } else { error.to_string() })
}

fn try_to_write(path: &Path) -> io::Result<()> {
    let mut file = File::options().append(true).open(path)?;
    let bytes = file.metadata()?.len();
    let zeros = vec![0_u8; TRIED];
    let written = file.write_all(&zeros);
    // What is no plain file has no length.
    let _ = file.set_len(bytes);
    written
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_file_that_can_be_written_stays_as_it_is() {
        let path = std::env::temp_dir().join(format!("nappe-rerun-{}.rrd", std::process::id()));
        fs::write(&path, "kept").expect("written");
        assert_eq!(why_unwritten(&path), None);
        assert_eq!(fs::read_to_string(&path).expect("read"), "kept");
        fs::remove_file(&path).expect("removed");
        assert!(why_unwritten(&path).is_some(), "it is gone");
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_named() {
        let why = why_unwritten(Path::new("/dev/full")).expect("it takes nothing");
        assert!(why.starts_with("the disk is full ("), "{why}");
    }
}
