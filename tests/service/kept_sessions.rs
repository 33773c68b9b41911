//! Sessions that a server keeps in a folder: made and deleted, they leave nothing there.

use std::{
    fs,
    path::{Path, PathBuf},
    process,
    time::Duration,
};

use nappe_proto::v1;
use nappe_server::Config;

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, config},
};

/// Sessions that are made and deleted.
const COUNT: usize = if cfg!(feature = "slow") { 1_000 } else { 30 };

/// The names in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").file_name());
    let mut names: Vec<String> = entries.map(|name| name.to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[tokio::test(flavor = "multi_thread")]
async fn sessions_that_were_made_and_deleted_leave_no_file() {
    let folder: PathBuf =
        Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("kept-sessions-{}", process::id()));
    let kept = Config { state_dir: Some(folder.clone()), checkpoint_seconds: 0.0, ..config() };
    let mut server = Server::configured(kept).await;
    for number in 0..COUNT {
        let id = server.session(sheet(3)).await;
        // Some have one state, and some may be written when they go.
        if number % 3 > 0 {
            server.step(&id, 2).await;
        }
        assert!(server.get(&id).await.durability.is_some(), "it is kept");
        server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("it is deleted");
    }
    let sessions = folder.join("sessions");
    let emptied = async {
        while !names(&sessions).is_empty() {
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    in_time(emptied).await;
    // All were of one setup, which the next start removes. No token was asked for.
    assert!(names(&folder.join("setups")).len() <= 1);
    assert_eq!(names(&folder), ["lock", "sessions", "setups"]);
    drop(server);
    fs::remove_dir_all(folder).expect("removed");
}
