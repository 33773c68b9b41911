//! Every method of the contract with its largest messages: what the server takes stays within what it counts, and little more.

use std::{collections::BTreeMap, sync::atomic::Ordering};

use bytes::Bytes;
use fastrand::Rng;
use nappe_server::Limits;

use crate::{
    IGNORED, alone,
    contract::{Caller, Method, methods},
    messages::Names,
    requests::runtime,
    start, used,
    watch::{Watch, as_client, excess},
};

/// Bytes that may be in use beyond those that are counted.
const SLACK: usize = 32 << 20;
/// Bytes from which an allocation only shows that there is so much: larger than any array here.
const SEEN_ONLY: usize = 128 << 20;
/// Calls at random, and after how many of them sessions that were deleted are made again.
const CALLS: usize = if cfg!(feature = "slow") { 10_000 } else { 100 };
const MADE_AGAIN: usize = 100;
const SEED: u64 = 1;

/// Limits of a server with a memory of 1 GiB that counts few frames: what it counts is taken soon.
fn limits(max_particles: u64, max_mesh_bytes: u64) -> Limits {
    Limits {
        max_server_bytes: 1 << 30,
        history_bytes_per_session: 16 << 20,
        max_held_bytes: 4 << 20,
        max_particles,
        max_mesh_bytes,
        // Those that are begun and not finished keep their places.
        max_uploads: 10_000,
        ..Limits::default()
    }
}

/// A client that knows every method, and what became of its calls.
struct Client {
    caller: Caller,
    methods: Vec<Method>,
    names: Names,
    /// How many calls of each method were accepted.
    accepted: BTreeMap<String, usize>,
    /// Why the last one of each method was refused.
    refused: BTreeMap<String, String>,
}

impl Client {
    async fn to(url: String, limits: &Limits) -> Self {
        let caller = Caller::to(url).await;
        Self {
            caller,
            methods: methods(),
            names: Names::new(limits),
            accepted: BTreeMap::new(),
            refused: BTreeMap::new(),
        }
    }

    /// Makes a call of a method, after which no more may be in use than was allowed.
    async fn call(&mut self, method: usize, messages: Vec<Bytes>) {
        let method = &self.methods[method];
        let answer = self.caller.call(method, messages).await;
        let (name, beyond) = (&method.name, excess());
        assert!(
            beyond == 0,
            "{name}: {beyond} bytes beyond what is allowed; {:?}",
            answer.map(|_| "accepted")
        );
        match answer {
            Ok(answer) => {
                self.names.take(method, &answer);
                *self.accepted.entry(name.clone()).or_default() += 1;
            }
            Err(refusal) => {
                self.refused.insert(name.clone(), refusal.to_string());
            }
        }
    }

    /// Makes the sessions that are not there.
    async fn make_sessions(&mut self) {
        let create = self.methods.iter().position(|method| method.name == "CreateSession");
        let create = create.expect("the contract has it");
        for messages in self.names.calls(&self.methods[create]) {
            self.call(create, messages).await;
        }
    }
}

/// Makes every call of every method once, and gives the methods of which none was accepted, and why.
async fn every_call(url: String, limits: Limits) -> Vec<String> {
    let mut client = Client::to(url, &limits).await;
    for method in 0..client.methods.len() {
        client.make_sessions().await;
        for messages in client.names.calls(&client.methods[method]) {
            client.call(method, messages).await;
        }
    }
    println!("accepted: {:?}", client.accepted);
    let names = client.methods.iter().map(|method| method.name.clone());
    let none = names.filter(|name| !client.accepted.contains_key(name));
    none.map(|name| format!("{name}: {}", client.refused.get(&name).map_or("not called", String::as_str)))
        .collect()
}

/// Makes calls at random, and gives how many were accepted.
async fn calls_at_random(url: String, limits: Limits) -> usize {
    let (mut client, mut random) = (Client::to(url, &limits).await, Rng::with_seed(SEED));
    for number in 0..CALLS {
        if number % MADE_AGAIN == 0 {
            client.make_sessions().await;
        }
        let method = random.usize(0..client.methods.len());
        let mut calls = client.names.calls(&client.methods[method]);
        let messages = calls.swap_remove(random.usize(0..calls.len()));
        client.call(method, messages).await;
    }
    println!("of {CALLS} calls at random, accepted: {:?}", client.accepted);
    client.accepted.values().sum()
}

/// Does the work of a client of a server, while the memory of the server is watched.
fn watched<T: Send, F: Future<Output = T> + Send>(
    limits: &Limits,
    work: impl FnOnce(String, Limits) -> F,
) -> T {
    IGNORED.store(SEEN_ONLY, Ordering::Relaxed);
    let server = runtime();
    let app = server.block_on(async { start(limits.clone()) });
    let (counted, before) = (app.reserved(), used());
    let watch = Watch::begin(move || before + SLACK + counted() as usize);
    let done = as_client(work(app.url(), limits.clone()));
    drop(watch);
    server.block_on(app.shutdown());
    IGNORED.store(usize::MAX, Ordering::Relaxed);
    done
}

#[test]
fn every_method_with_its_largest_messages_takes_what_is_counted_and_little_more() {
    let _alone = alone();
    let refused = watched(&limits(400_000, 28 << 20), every_call);
    assert!(refused.is_empty(), "no call of these methods was accepted: {refused:?}");
}

#[test]
fn calls_at_random_with_the_largest_messages_take_what_is_counted_and_little_more() {
    let _alone = alone();
    let accepted = watched(&limits(200_000, 16 << 20), calls_at_random);
    assert!(accepted > CALLS / 10, "{accepted} of {CALLS} calls were accepted");
}
