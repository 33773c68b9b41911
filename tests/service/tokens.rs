//! Who may call: whoever shows the token of the server. Clients of the same user find it by themselves.

use std::path::{Path, PathBuf};

use nappe_client::{ClientError, Token};
use nappe_proto::v1;
use nappe_server::{App, Config, Reason, StartError};
use tonic::{Request, Status};
use tonic_health::pb::{HealthCheckRequest, health_client::HealthClient};

use crate::{
    frames::in_time,
    grpc_web::exchange_at,
    harness::{assert_reason, channel, config, connect},
};

/// A server with the token that it draws by default, on a free port of loopback.
fn guarded(config: Config) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, ..config }).expect("the server starts")
}

fn token(app: &App) -> &str {
    app.token().expect("a token is the default").reveal()
}

/// Asks for the server's information with this value of the header.
async fn ask(app: &App, authorization: Option<&str>) -> Result<(), Status> {
    let mut request = Request::new(v1::GetServerInfoRequest {});
    if let Some(value) = authorization {
        request.metadata_mut().insert("authorization", value.parse().expect("a header"));
    }
    connect(app).await.get_server_info(request).await.map(|_| ())
}

#[tokio::test(flavor = "multi_thread")]
async fn a_call_without_the_token_is_refused_and_one_with_it_is_answered() {
    let app = guarded(config());
    let token = token(&app);
    assert_eq!(token.len(), 32, "128 bits in hexadecimal digits");

    for missing in [None, Some("Basic dXNlcjpwYXNz"), Some(token)] {
        let refused = ask(&app, missing).await.expect_err("no token");
        assert_reason(&refused, Reason::TokenMissing);
        assert!(!format!("{refused:?}").contains(token));
    }
    let other = guarded(config());
    assert_ne!(token, other.token().expect("a token").reveal(), "each server draws its own");
    for wrong in ["0123456789abcdef", other.token().expect("a token").reveal(), &token[1..]] {
        let refused = ask(&app, Some(&format!("Bearer {wrong}"))).await.expect_err("a wrong token");
        assert_reason(&refused, Reason::TokenWrong);
        assert!(!format!("{refused:?}").contains(wrong));
    }
    ask(&app, Some(&format!("Bearer {token}"))).await.expect("the token");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_of_the_same_user_finds_the_token_by_itself() {
    let app = guarded(config());
    let path = app.token_path().expect("it is left in a file").to_owned();
    assert_private(&path);

    let port = app.local_addr().port();
    for address in [app.url(), format!("127.0.0.1:{port}"), format!("localhost:{port}")] {
        let client = nappe_client::Client::connect(&address).await.expect("connected");
        client.server_info().await.expect(&address);
    }
    let client = nappe_client::Client::connect(&app.url()).await.expect("connected");
    let wrong = Token::parse("0123456789abcdef").expect("a token");
    let stranger = nappe_client::Client::connect_with(&app.url(), &wrong).await.expect("connected");
    let refused = stranger.server_info().await.expect_err("a wrong token");
    assert_eq!(refused.reason(), Some("TOKEN_WRONG"));

    // A server that is gone leaves nothing, and another on its port is shown nothing.
    in_time(app.shutdown()).await;
    assert!(!path.exists(), "{} is removed at the end", path.display());
    drop(client);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_client_shows_the_new_token_of_a_server_that_was_started_again() {
    let (client, again) = loop {
        let app = guarded(config());
        let address = app.local_addr();
        let client = nappe_client::Client::connect(&app.url()).await.expect("connected");
        client.server_info().await.expect("answered");
        in_time(app.shutdown()).await;

        // Somebody else may take the port meanwhile, and then we try another one.
        match App::start(Config { address: address.into(), ..config() }) {
            Ok(again) => break (client, again),
            Err(error) => assert!(matches!(error, StartError::Bind { .. }), "{error}"),
        }
    };
    let answered = async {
        // A call goes to the first as long as the client has not seen that connection end.
        while let Err(error) = client.server_info().await {
            assert!(matches!(error, ClientError::Transport { .. }), "{error}");
        }
    };
    in_time(answered).await;
    drop(again);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_token_can_be_fixed_or_left_out() {
    let file = temporary("fixed");
    std::fs::write(&file, "a-token-of-my-own-choice\n").expect("written");
    #[cfg(unix)]
    make_private(&file);
    let app = guarded(Config { token_file: Some(file.clone()), ..config() });
    assert_eq!(token(&app), "a-token-of-my-own-choice");
    ask(&app, None).await.expect_err("it is asked for");
    ask(&app, Some("Bearer a-token-of-my-own-choice")).await.expect("the token");

    std::fs::write(&file, "short\n").expect("written");
    let address = "127.0.0.1:0".parse().expect("an address");
    let short = Config { address, token_file: Some(file.clone()), ..config() };
    let refused = App::start(short).expect_err("no token").to_string();
    assert!(refused.contains("16") && !refused.contains("short"), "{refused}");
    std::fs::remove_file(file).expect("removed");

    let open = guarded(Config { no_token: true, ..config() });
    assert!(open.token().is_none() && open.token_path().is_none());
    ask(&open, None).await.expect("everybody may call");
}

#[tokio::test(flavor = "multi_thread")]
async fn health_answers_probes_and_web_pages_may_show_a_token() {
    let app = guarded(config());
    let mut health = HealthClient::new(channel(&app).await);
    health.check(HealthCheckRequest::default()).await.expect("a probe has no token");
    let refused = health.watch(HealthCheckRequest::default()).await.expect_err("a stream takes a place");
    assert_reason(&refused, Reason::TokenMissing);

    let preflight = "Origin: http://localhost:5173\r\nAccess-Control-Request-Method: POST\r\n\
                     Access-Control-Request-Headers: authorization,content-type\r\n";
    let path = "/nappe.v1.SimulationService/GetServerInfo";
    let answer = exchange_at(app.local_addr(), "OPTIONS", path, preflight, b"").await;
    let allowed = answer.header("access-control-allow-headers").expect("headers");
    assert!(allowed.contains("authorization"), "{allowed}");
    let web = "Content-Type: application/grpc-web+proto\r\n";
    let refused = exchange_at(app.local_addr(), "POST", path, web, &[0; 5]).await;
    assert_eq!(refused.reason(), Reason::TokenMissing.name());
    let shown = format!("{web}Authorization: Bearer {}\r\n", token(&app));
    let answer = exchange_at(app.local_addr(), "POST", path, &shown, &[0; 5]).await;
    assert_eq!((answer.status, answer.header("grpc-status")), (200, None));
}

fn temporary(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}.token", std::process::id()))
}

#[cfg(unix)]
fn make_private(path: &Path) {
    use std::os::unix::fs::PermissionsExt as _;
    std::fs::set_permissions(path, std::fs::Permissions::from_mode(0o600)).expect("set");
}

#[cfg(unix)]
fn assert_private(path: &Path) {
    use std::os::unix::fs::PermissionsExt as _;
    let mode = |path: &Path| std::fs::metadata(path).expect("it is there").permissions().mode() & 0o777;
    assert_eq!(mode(path), 0o600);
    assert_eq!(mode(path.parent().expect("a folder")), 0o700);
}

#[cfg(not(unix))]
fn assert_private(_: &Path) {}
