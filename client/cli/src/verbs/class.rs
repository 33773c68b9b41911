//! `nappe class`: a server for a lesson until Ctrl-C, with a scene that plays, a link for the teacher, and one for all pupils.

use std::{
    future,
    io::{self, IsTerminal as _},
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket},
};

use clap::Args;
use nappe_client::{Client, Wait, v1};
use nappe_server::{Address, App, Config, Limits, Log, LogError, numbers::whole};
use qrcode::{QrCode, render::unicode::Dense1x2};
use serde_json::json;

use crate::{
    options::args::OverrideArgs,
    outside::remote,
    scenes::scene::{Input, Names},
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs, several, three},
    },
};

/// Pupils at most: each opens the class's link twice, which it allows 1 000 times at most.
const MOST_PUPILS: u64 = 200;
/// Sessions beside a copy for each pupil: the scene's own, and some of the teacher's.
const OTHERS: u32 = 4;
/// Connections that a browser has to a server at a time.
const CONNECTIONS: u32 = 6;
/// What a session keeps of its frames (bytes): some seconds of a lesson's scene.
const HISTORY_BYTES: u64 = 16 << 20;
/// After so long a session goes that nobody calls, watches or plays (s).
const IDLE_SECONDS: u32 = 30 * 60;
/// How long the class's link is good, and what it gave (s): as long as may be.
const LINK_SECONDS: u32 = 12 * 3600;
/// How often each pupil can open the link: a tab that is closed has lost its token.
const OPENINGS: u32 = 2;
/// Id of the scene's session.
const ID: &str = "class";
/// Steps that are timed at most, and seconds of stepping that are enough.
const TIMED_STEPS: u64 = 40;
const TIMED_SECONDS: f64 = 0.5;
/// Pictures per second that a page asks for at most, and bytes of a particle in one.
const PICTURES: f64 = 60.0;
const PARTICLE_BYTES: f64 = 12.0;

/// Run a server for a class: one link for all pupils
///
/// A scene plays, and everybody who opens the link of the class watches it and has a copy of it that nobody else can touch.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe class hanging_sheet --pupils 30        on this machine alone, for pupils who come through ssh
  nappe class flag --pupils 12 --allow-remote --address 0.0.0.0:6277     for all machines of the network

It prints two links. The teacher's is for a browser on this machine, and may do everything; it is good once and for 10
minutes, and `nappe view --web` makes another. The class's can be opened twice by each pupil, for 12 hours; on a terminal
it is a QR code too. Each opening may watch the scene's session, make one copy of it at a time, and steer that copy.

There is no encryption. Over a network, whoever listens on the way can do what a pupil can, and nothing else: watch, and
steer the copy of the pupil that he listens to.

Each session has one thread and keeps 16 MiB of frames; one that nobody uses for half an hour is deleted. How many cores
and how much of the network the copies need in real time is told from the first steps.

With --json the first line is an object with `url`, `link` (the teacher's) and `class_link`. Ctrl-C ends all.")]
pub(crate) struct ClassArgs {
    /// A scene that comes with nappe, or a scene file (.toml)
    scene: String,
    /// How many pupils there are, 1 to 200: so many copies there can be at a time
    #[arg(long, value_name = "N", value_parser = whole::<u32>(1..=MOST_PUPILS))]
    pupils: u32,
    /// Address and port to listen on, as localhost:6277, port 0 for a free one; 0.0.0.0:6277 are all networks of this machine
    #[arg(long, env = "NAPPE_ADDRESS", default_value_t = Config::default().address)]
    address: Address,
    /// Allow an address that other machines can reach: whoever listens on the way can do what a pupil can
    #[arg(long, env = "NAPPE_ALLOW_REMOTE")]
    allow_remote: bool,
    /// What is logged, in the syntax of tracing: error, warn, info, debug, nappe_server=debug
    #[arg(long, env = "NAPPE_LOG", default_value = "warn")]
    log: String,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe class`.
///
/// # Errors
/// When the scene cannot be read or is refused, its first steps fail, or the address cannot be had.
pub(crate) fn run(args: &ClassArgs) -> Result<()> {
    if !matches!(args.address, Address::Tcp(_)) {
        let why = "--address: browsers cannot reach a Unix socket; a class needs HOST:PORT";
        return Err(CliError::usage(why));
    }
    let scene = Input::read(&args.scene, Names::Ours)?;
    remote::block_on(async {
        let _log = Log::start(&args.log).map_err(|error| match error {
            LogError::Filter { .. } => CliError::usage(error),
            error => CliError::failure(error),
        })?;
        let signals = remote::catch_signals()?;
        let app = App::start(config(args)).map_err(CliError::failure)?;
        let ended = tokio::select! {
            failed = Box::pin(hold(&app, &scene, args)) => failed,
            signal = remote::interrupted_by(signals) => signal,
        };
        app.shutdown().await;
        ended
    })
}

/// The settings of the server.
fn config(args: &ClassArgs) -> Config {
    let usual = Limits::default();
    let sessions = args.pupils + OTHERS;
    // Behind one address there may be all: pupils who come through ssh have that of the machine.
    let connections = usual.max_connections.max(CONNECTIONS * sessions);
    let limits = Limits {
        max_sessions: sessions,
        idle_session_seconds: IDLE_SECONDS,
        max_watchers_per_session: usual.max_watchers_per_session.max(OPENINGS * sessions),
        max_threads_per_session: 1,
        history_bytes_per_session: HISTORY_BYTES,
        max_connections: connections,
        max_connections_per_address: connections,
        ..usual
    };
    Config { address: args.address.clone(), allow_remote: args.allow_remote, limits, ..Config::default() }
}

/// Makes the session and the links, tells them, and waits for ever.
async fn hold(app: &App, scene: &Input, args: &ClassArgs) -> Result<()> {
    let token = app.token().ok_or_else(|| CliError::failure("the server in this command has no token"))?;
    let client = Client::connect_with(&app.url(), token).await?;
    // Without an end: a scene's own may come before the first pupil does.
    scene.create(&client, ID.to_owned(), &OverrideArgs::endless(), None).await?;
    let begun = first_steps(&client).await?;
    client.play(ID, 1.0).await?;
    let class = Class {
        link: teachers_link(app)?,
        for_pupils: class_link(app, &client, args.pupils).await?,
        need: Need::of(&begun, args.pupils),
        title: begun.title,
    };
    class.announce(app, args)?;
    future::pending().await
}

/// Takes and times some steps: what a copy needs is seen in them. Afterwards the session stands.
async fn first_steps(client: &Client) -> Result<v1::Session> {
    let mut session = remote::answer(ID, client.step(ID, 1, Wait::Yes)).await?;
    while session.step < TIMED_STEPS && session.stepping_seconds < TIMED_SECONDS {
        session = remote::answer(ID, client.step(ID, 1, Wait::Yes)).await?;
    }
    Ok(session)
}

/// A link for a browser on this machine, which may then do everything.
fn teachers_link(app: &App) -> Result<String> {
    let link = app.page_link().map_err(CliError::failure)?;
    let link = link.ok_or_else(|| CliError::failure("this nappe was built without the page for browsers"))?;
    Ok(link.replacen('#', &format!("?session={ID}#"), 1))
}

/// The link of the class: the address of this machine as others have it, and a code that all pupils open.
async fn class_link(app: &App, client: &Client, pupils: u32) -> Result<String> {
    let request = v1::MakeLinkRequest {
        session_id: ID.to_owned(),
        forks: 1,
        uses: OPENINGS * pupils,
        seconds: LINK_SECONDS,
    };
    let made = client.make_session_link(request).await?;
    Ok(format!("http://{}/?session={ID}#{}", reached_at(app.local_addr()), made.code))
}

/// Where other machines find a server that listens here: at one of this machine's addresses, where it listens at all of them.
fn reached_at(listens: SocketAddr) -> SocketAddr {
    if !listens.ip().is_unspecified() {
        return listens;
    }
    // Addresses that are kept for documentation. Nothing is sent there: the system is asked which way it would take.
    let (far, loopback): (IpAddr, IpAddr) = if listens.is_ipv4() {
        (Ipv4Addr::new(192, 0, 2, 1).into(), Ipv4Addr::LOCALHOST.into())
    } else {
        (Ipv6Addr::new(0x2001, 0x0db8, 0, 0, 0, 0, 0, 1).into(), Ipv6Addr::LOCALHOST.into())
    };
    let own = UdpSocket::bind((listens.ip(), 0)).and_then(|socket| {
        socket.connect((far, 9))?;
        socket.local_addr()
    });
    SocketAddr::new(own.map_or(loopback, |own| own.ip()), listens.port())
}

/// What is told of a class.
struct Class {
    title: String,
    link: String,
    /// The link of the class.
    for_pupils: String,
    need: Need,
}

impl Class {
    /// Says where the server listens, how browsers come in, and what so many copies need.
    fn announce(&self, app: &App, args: &ClassArgs) -> Result<()> {
        let Self { title, link, for_pupils, need } = self;
        if args.output.format() == Format::Json {
            output::note(&need.told());
            return output::json(&json!({ "url": app.url(), "link": link, "class_link": for_pupils }));
        }

        let (version, url, pupils) = (env!("CARGO_PKG_VERSION"), app.url(), args.pupils);
        let (pupils, openings) = (several(pupils.into(), "pupil"), OPENINGS * pupils);
        let reach = if app.address().is_remote() {
            "There is no encryption: whoever listens on the way can do what a pupil can, which is to watch, and to steer that pupil's copy."
        } else {
            "This machine alone reaches it, and who comes through ssh; --allow-remote --address 0.0.0.0:6277 lets the network in."
        };
        output::line(&format!(
            "nappe {version} shows '{title}' to a class of {pupils} on {url}; Ctrl-C ends it\n{reach}\n{}\n\
             the teacher, in a browser on this machine, once and within 10 minutes: {link}\n\
             the class, {openings} times within 12 hours: {for_pupils}",
            need.told(),
        ))?;
        match picture(for_pupils) {
            Some(picture) if io::stdout().is_terminal() => output::verbatim(&picture),
            _ => Ok(()),
        }
    }
}

/// What copies of a session need in real time.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Need {
    copies: u32,
    /// Steps that it is judged by.
    steps: u64,
    cores: f64,
    /// Of the network, where each copy is watched by one page, as its pictures are (bytes per second).
    bytes_per_second: f64,
}

impl Need {
    /// What so many copies need, judged by the steps that the session has taken.
    fn of(session: &v1::Session, copies: u32) -> Self {
        let steps = session.step.max(1);
        let simulated = session.dt_seconds * steps as f64;
        let made = 1.0 / (session.dt_seconds * f64::from(session.frame_interval_steps.max(1)));
        let picture_bytes = PARTICLE_BYTES * session.particle_count as f64;
        let count = f64::from(copies);
        Self {
            copies,
            steps,
            cores: count * session.stepping_seconds / simulated,
            bytes_per_second: count * picture_bytes * made.min(PICTURES),
        }
    }

    /// The need in words, beside what there is.
    fn told(&self) -> String {
        let Self { copies, steps, cores, bytes_per_second } = *self;
        let there = Limits::default().thread_limit();
        let enough = if cores <= f64::from(there) {
            "which is enough"
        } else {
            "so that they are slower than real time, in equal shares"
        };
        format!(
            "{} in real time need about {} cores, by the first {}; there {}, {enough}. Pages need {} MB/s of the network at most",
            if copies == 1 { "1 copy".to_owned() } else { format!("{copies} copies") },
            three(cores),
            several(steps, "step"),
            if there == 1 { "is 1".to_owned() } else { format!("are {there}") },
            three(bytes_per_second / 1e6),
        )
    }
}

/// A QR code as lines of a terminal: black on white, whatever the colours there are. None of a text that is too long for one.
fn picture(text: &str) -> Option<String> {
    let drawn = QrCode::new(text).ok()?.render::<Dense1x2>().build();
    let lines = drawn.lines().map(|line| format!("\u{1b}[30;107m{line}\u{1b}[0m"));
    Some(lines.collect::<Vec<_>>().join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn copies_need_what_the_first_steps_took_in_real_time() {
        let session = v1::Session {
            step: 40,
            dt_seconds: 0.005,
            stepping_seconds: 0.1,
            frame_interval_steps: 4,
            particle_count: 1600,
            ..v1::Session::default()
        };
        // Half a core for each, and 50 pictures of 19 200 bytes a second.
        let need = Need::of(&session, 30);
        assert!((need.cores - 15.0).abs() < 1e-9, "{need:?}");
        assert!((need.bytes_per_second - 28.8e6).abs() < 1.0, "{need:?}");
        assert!(
            need.told().starts_with("30 copies in real time need about 15.0 cores, by the first 40 steps; ")
        );
        assert!(need.told().ends_with("Pages need 28.8 MB/s of the network at most"), "{}", need.told());
        // A page asks for no more than 60 pictures a second.
        let often = Need::of(&v1::Session { frame_interval_steps: 1, ..session }, 1);
        assert!((often.bytes_per_second - 60.0 * 19_200.0).abs() < 1.0, "{often:?}");
        assert!(often.told().starts_with("1 copy in real time"), "{}", often.told());
    }

    #[test]
    fn a_link_names_the_address_that_others_reach() {
        for kept in ["127.0.0.1:6277", "192.0.2.7:80", "[::1]:6277"] {
            let kept: SocketAddr = kept.parse().expect("an address");
            assert_eq!(reached_at(kept), kept);
        }
        for all in ["0.0.0.0:6277", "[::]:6277"] {
            let all: SocketAddr = all.parse().expect("an address");
            let found = reached_at(all);
            assert!(!found.ip().is_unspecified() && found.port() == 6277, "{found}");
            assert_eq!(found.is_ipv4(), all.is_ipv4());
        }
    }

    #[test]
    fn a_qr_code_is_dark_on_light_with_an_edge_of_four_modules() {
        let link = format!("http://192.168.100.200:6277/?session=class#{}", "0123456789abcdef".repeat(2));
        let picture = picture(&link).expect("it is short");
        let inner = |line: &str| -> Vec<char> {
            let line = line.strip_prefix("\u{1b}[30;107m").expect("black on white");
            line.strip_suffix("\u{1b}[0m").expect("and as before afterwards").chars().collect()
        };
        let rows: Vec<Vec<char>> = picture.lines().map(inner).collect();
        let width = rows[0].len();
        // The link fits on a screen of 80 columns and 25 lines.
        assert!(width < 60 && rows.len() < 25 && rows.iter().all(|row| row.len() == width), "{picture}");
        assert!(rows[..2].iter().flatten().all(|c| *c == ' '), "{picture}");
        // The corner, seven modules wide: a frame around a square, two modules to a line.
        let corner: Vec<String> = rows[2..6].iter().map(|row| row[..12].iter().collect()).collect();
        assert_eq!(corner, ["    █▀▀▀▀▀█ ", "    █ ███ █ ", "    █ ▀▀▀ █ ", "    ▀▀▀▀▀▀▀ "], "{picture}");
    }
}
