//! Links that work once: a code for whoever has the token, and the token for whoever has a code, once and in time.

use std::time::Duration;

use nappe_client::ClientError;
use nappe_proto::v1;
use nappe_server::{App, Config, Reason};
use prost::Message as _;
use tonic::{Request, Status};

use crate::{
    grpc_web::{exchange_at, framed},
    harness::{assert_reason, config, connect, started},
};

const OPEN: &str = "/nappe.v1.SimulationService/OpenLink";
const WEB: &str = "Content-Type: application/grpc-web+proto\r\n";

/// A server with the token that it draws by default, on a free port of loopback.
fn guarded(config: Config) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, ..config }).expect("the server starts")
}

fn token(app: &App) -> &str {
    app.token().expect("a token is the default").reveal()
}

/// Makes a link as the command does.
async fn make(app: &App) -> Result<v1::MakeLinkResponse, ClientError> {
    nappe_client::Client::connect(&app.url()).await.expect("connected").make_link().await
}

async fn code(app: &App) -> String {
    make(app).await.expect("a link").code
}

/// Opens a link without a token, as a page does.
async fn open(app: &App, code: &str) -> Result<String, Status> {
    let request = v1::OpenLinkRequest { code: code.to_owned() };
    connect(app).await.open_link(request).await.map(|answer| answer.into_inner().token)
}

async fn assert_closed(app: &App, code: &str) {
    let refused = open(app, code).await.expect_err("it is not good");
    assert_reason(&refused, Reason::LinkNotFound);
    let told = format!("{refused:?}");
    assert!((code.is_empty() || !told.contains(code)) && !told.contains(token(app)), "{told}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_gives_the_token_once() {
    let app = guarded(config());
    let made = make(&app).await.expect("a link");
    assert_eq!((made.code.len(), made.expires_in_seconds), (32, 600.0), "128 bits, and ten minutes");
    assert_ne!(made.code, token(&app));
    let given = open(&app, &made.code).await.expect("it is good");
    assert_eq!(given, token(&app));
    assert_closed(&app, &made.code).await;

    // What it gave is the token.
    let shown = nappe_client::Token::parse(&given).expect("a token");
    let client = nappe_client::Client::connect_with(&app.url(), &shown).await.expect("connected");
    client.server_info().await.expect("it lets in");
}

#[tokio::test(flavor = "multi_thread")]
async fn of_many_who_open_a_link_at_once_one_gets_the_token() {
    let app = std::sync::Arc::new(guarded(config()));
    let code = code(&app).await;
    let mut calls = tokio::task::JoinSet::new();
    for _ in 0..16 {
        let (app, code) = (std::sync::Arc::clone(&app), code.clone());
        calls.spawn(async move { open(&app, &code).await.is_ok() });
    }
    let opened = calls.join_all().await.into_iter().filter(|is_open| *is_open).count();
    assert_eq!(opened, 1);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_is_made_by_whoever_has_the_token() {
    let app = guarded(config());
    let ask = async |authorization: Option<&str>| {
        let mut request = Request::new(v1::MakeLinkRequest::default());
        if let Some(value) = authorization {
            request.metadata_mut().insert("authorization", value.parse().expect("a header"));
        }
        connect(&app).await.make_link(request).await
    };
    assert_reason(&ask(None).await.expect_err("no token"), Reason::TokenMissing);
    let wrong = ask(Some("Bearer 0123456789abcdef")).await.expect_err("a wrong token");
    assert_reason(&wrong, Reason::TokenWrong);
    // A code is no token.
    let code = code(&app).await;
    let refused = ask(Some(&format!("Bearer {code}"))).await.expect_err("a code");
    assert_reason(&refused, Reason::TokenWrong);
    ask(Some(&format!("Bearer {}", token(&app)))).await.expect("the token");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_code_that_is_guessed_torn_or_of_another_server_opens_nothing_and_spoils_nothing() {
    let (app, other) = (guarded(config()), guarded(config()));
    let good = code(&app).await;
    let strange = code(&other).await;
    let zeros = "0".repeat(32);
    let twice = format!("{good}{good}");
    let blank = format!("{good} ");
    for bad in ["", &good[..31], &good[1..], &twice, &blank, &zeros, &strange, &"x".repeat(900)] {
        assert_closed(&app, bad).await;
    }
    assert_eq!(open(&app, &good).await.expect("it is good still"), token(&app));
    assert_eq!(open(&other, &strange).await.expect("it is good there"), token(&other));
}

#[tokio::test(flavor = "multi_thread")]
async fn sixty_four_links_are_good_at_a_time_and_the_oldest_gives_way() {
    let app = guarded(config());
    let maker = nappe_client::Client::connect(&app.url()).await.expect("connected");
    let mut codes = Vec::new();
    for _ in 0..=App::MOST_LINKS {
        codes.push(maker.make_link().await.expect("a link").code);
    }
    assert_eq!(codes.len(), 65);
    assert_closed(&app, &codes[0]).await;
    let mut opener = connect(&app).await;
    for code in &codes[1..] {
        let given = opener.open_link(v1::OpenLinkRequest { code: code.clone() }).await;
        assert_eq!(given.expect("one of sixty-four").into_inner().token, token(&app));
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_link_that_is_too_old_opens_nothing() {
    let link_time = Duration::from_millis(200);
    let app = guarded(Config { link_time, ..config() });
    let made = make(&app).await.expect("a link");
    assert_eq!(made.expires_in_seconds, 0.2);
    tokio::time::sleep(link_time).await;
    assert_closed(&app, &made.code).await;
}

#[tokio::test(flavor = "multi_thread")]
async fn a_page_of_loopback_opens_a_link_and_a_foreign_one_does_not() {
    let app = guarded(config());
    let code = code(&app).await;
    let message = framed(&v1::OpenLinkRequest { code }.encode_to_vec());
    let server = app.local_addr();
    let foreign = format!("{WEB}Origin: https://evil.example\r\n");
    let refused = exchange_at(server, "POST", OPEN, &foreign, &message).await;
    assert_eq!(refused.reason(), Reason::OriginNotAllowed.name());

    // An old token of the tab does not matter.
    let page = format!("{WEB}Origin: http://localhost:5173\r\nAuthorization: Bearer 0123456789abcdef\r\n");
    let answer = exchange_at(server, "POST", OPEN, &page, &message).await;
    let given: v1::OpenLinkResponse = answer.message();
    assert_eq!(given.token, token(&app));
}

#[tokio::test(flavor = "multi_thread")]
async fn a_server_that_asks_for_no_token_gives_none_for_a_link() {
    let app = started(config());
    let code = code(&app).await;
    assert_eq!(open(&app, &code).await.expect("it is good"), "");
    let refused = open(&app, &code).await.expect_err("it was good once");
    assert_reason(&refused, Reason::LinkNotFound);
}

#[tokio::test(flavor = "multi_thread")]
async fn the_address_of_the_page_has_a_code_where_a_token_is_asked_for() {
    let app = guarded(config());
    let link = app.page_link().expect("random numbers").expect("it listens on TCP");
    let code = link.strip_prefix(&format!("{}/#", app.url())).expect("the page and a code");
    assert_eq!(open(&app, code).await.expect("it is good"), token(&app));

    let open = started(config());
    let link = open.page_link().expect("random numbers").expect("it listens on TCP");
    assert_eq!(link, format!("{}/", open.url()));
}
