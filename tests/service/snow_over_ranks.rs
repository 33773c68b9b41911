//! Sessions with snow that ranks step: what they warn of, and what is refused while they live on.

use nappe_proto::v1;

use crate::{hung_ranks::StandIn, snow_scenes::block};

#[tokio::test(flavor = "multi_thread")]
async fn more_ranks_than_blocks_of_snow_are_warned_of_once() {
    let stand_in = StandIn::of(2);
    let mut server = stand_in.server_of(1).await;
    let (made, _) = stand_in.make(&server, block(1, ""), 2).await.expect("a session");
    let told = made.warnings.iter().filter(|warning| warning.contains("2 ranks share 1 blocks"));
    assert_eq!(told.count(), 1, "{:?}", made.warnings);
    let mut different = made.warnings.clone();
    different.sort_unstable();
    different.dedup();
    assert_eq!(different.len(), made.warnings.len(), "{:?}", made.warnings);
    let id = made.session.expect("the answer has the session").session_id;
    assert_eq!(server.step(&id, 2).await.step, 2);
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("it is deleted");
}
