//! Changes of parameters that wait for their step: listed, and dropped.

use nappe_proto::v1;
use tonic::Request;

use crate::{
    client::{CALL_LIMIT, Client, NO_LIMIT, PAGE_SIZE},
    error::ClientError,
};

impl Client {
    /// The changes that wait for their step, in the order in which they take effect.
    ///
    /// # Errors
    /// If there is no such session, or a call fails.
    pub async fn pending_changes(&self, session_id: &str) -> Result<Vec<v1::PendingChange>, ClientError> {
        let (mut changes, mut page_token) = (Vec::new(), String::new());
        loop {
            let request = Request::new(v1::ListPendingChangesRequest {
                page_size: PAGE_SIZE,
                page_token,
                ..v1::ListPendingChangesRequest::of(session_id)
            });
            let page = self
                .call("ListPendingChanges", CALL_LIMIT, request, async |mut calls, r| {
                    calls.list_pending_changes(r).await
                })
                .await?;
            // A page that holds nothing and promises more would never end.
            let is_last = page.next_page_token.is_empty() || page.changes.is_empty();
            changes.extend(page.changes);
            page_token = page.next_page_token;
            if is_last {
                return Ok(changes);
            }
        }
    }

    /// Puts every body, parameter and pin back to the session's start; steps, time and frames go on. Returns the step before
    /// which it took effect, and its order among all changes.
    ///
    /// # Errors
    /// If there is no such session, or it has ended.
    pub async fn reset(&self, session_id: &str) -> Result<v1::ResetSessionResponse, ClientError> {
        let request = v1::ResetSessionRequest::of(session_id);
        self.call("ResetSession", NO_LIMIT, Request::new(request), async |mut calls, r| {
            calls.reset_session(r).await
        })
        .await
    }

    /// Drops the changes of these calls, named by their order, that still wait; none named: all. Returns how many
    /// calls' changes were dropped.
    ///
    /// # Errors
    /// If there is no such session.
    pub async fn drop_changes(&self, session_id: &str, orders: &[u64]) -> Result<u64, ClientError> {
        let (session_id, orders) = (session_id.to_owned(), orders.to_vec());
        let request =
            Request::new(v1::DropPendingChangesRequest { session_id, orders, ..Default::default() });
        let answer = self
            .call("DropPendingChanges", CALL_LIMIT, request, async |mut calls, r| {
                calls.drop_pending_changes(r).await
            })
            .await?;
        Ok(answer.dropped_count)
    }
}
