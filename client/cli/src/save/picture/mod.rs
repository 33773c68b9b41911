//! A picture or a film of a run: its page, opened in a browser without a screen, draws the frames.
//!
//! The page is written as any other, beside the picture. The browser is asked for a frame by its number and answers when it is
//! drawn, however long that takes: no picture depends on how fast a machine is.

mod scratch;
mod found;
mod browser;
mod film;

use std::{
    fs::File,
    io::Read as _,
    path::{Path, PathBuf},
    time::Duration,
};

use base64::{Engine as _, engine::general_purpose::STANDARD};
use nappe_client::v1;
use nappe_scene::printable;
use serde_json::{Value, json};
use tokio::time::{Instant, sleep};

use self::{
    browser::{Browser, Trouble},
    film::{Cut, Film, nearest},
    scratch::Scratch,
};
use crate::{
    files::{aside::Growing, paths, write::Existing},
    options::picture_args::{PictureArgs, Size},
    outside::remote,
    words::{
        error::{CliError, Exit, Result},
        output,
    },
};

/// How long the page may take to open, and each picture to be drawn and taken. Many millions of particles take minutes where
/// there is no graphics card.
const PATIENCE: Duration = Duration::from_mins(10);
/// How long a browser may take to say what it is.
const START: Duration = Duration::from_mins(1);
/// How often the page is asked whether it is there.
const INTERVAL: Duration = Duration::from_millis(50);
/// Leaves nothing on the page but the picture, before anything is drawn.
const ALONE: &str = "addEventListener('DOMContentLoaded', () => {
    const style = document.createElement('style');
    style.textContent = '#side, #controls, .info, .legend { display: none !important }';
    document.head.append(style);
}, { once: true, capture: true })";
/// Times of the frames and what the page says instead of a picture, once the first one is drawn; null while there is no page.
const OPENED: &str = "typeof nappe === 'undefined' ? null : nappe.ready.then(() => \
    ({ times: nappe.times, message: document.getElementById('message').textContent }))";
/// What a file of PNG begins with, up to its width.
const PNG: &[u8] = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR";

/// A picture or a film that can be made.
pub(crate) struct Picture {
    asked: PictureArgs,
    /// Its name is held from the start.
    file: Growing,
    scratch: Scratch,
    browser: PathBuf,
    /// Who makes a film; none: it is a picture.
    ffmpeg: Option<PathBuf>,
}

impl Picture {
    /// Finds who draws it, and makes room for it.
    ///
    /// # Errors
    /// When there is no browser, or no ffmpeg for a film, and what to install; when the browser does not start; a file that is
    /// there and stays, and one that another run is writing.
    pub(super) async fn open(path: &Path, existing: Existing, asked: PictureArgs) -> Result<Self> {
        let ffmpeg = if paths::is_film(path) { Some(found::ffmpeg()?) } else { None };
        let browser = found::browser()?;
        let file = Growing::open(path, existing)?;
        let scratch = Scratch::beside(path)?;
        let mut asking = Browser::start(&browser, &scratch, START)?;
        let said = asking.call("Browser.getVersion", json!({})).await;
        asking.close().await;
        said?;
        Ok(Self { asked, file, scratch, browser, ffmpeg })
    }

    /// Where the page has to be written.
    pub(super) fn page(&self) -> PathBuf {
        self.scratch.page()
    }

    /// Checks that a session has the instant that is asked for.
    ///
    /// # Errors
    /// When it ends before.
    pub(crate) fn check(&self, session: &v1::Session) -> Result<()> {
        let Some(at) = self.asked.at().filter(|_| session.step_limit > 0) else { return Ok(()) };
        let left = session.step_limit.saturating_sub(session.step) as f64;
        let end = session.time_seconds + left * session.dt_seconds;
        if at <= end + 0.5 * session.dt_seconds {
            return Ok(());
        }
        Err(CliError::usage(format!("--at {at}: the run ends at t = {}", output::moment(end)))
            .hint("--steps N makes it longer"))
    }

    /// Draws what the page holds, if anything came, and gives the file its name.
    ///
    /// # Errors
    /// When the browser or ffmpeg dies or hangs, the page shows nothing, the file cannot be written, or the user ends it. No
    /// process stays.
    pub(crate) async fn draw(self) -> Result<()> {
        let Self { asked, mut file, scratch, browser, ffmpeg } = self;
        if !scratch.page().is_file() {
            return Ok(());
        }
        let mut browser = Browser::start(&browser, &scratch, PATIENCE)?;
        let drawn = tokio::select! {
            drawn = Box::pin(draw(&mut browser, asked, ffmpeg.as_deref(), &scratch, &mut file)) => drawn,
            signal = remote::interrupted() => signal.and_then(|()| {
                Err(CliError::new(Exit::Interrupted, "ended by the user while it was drawn: there is no picture"))
            }),
        };
        browser.close().await;
        drawn?;
        file.finish()
    }
}

/// Draws a picture or a film into a file.
async fn draw(
    browser: &mut Browser,
    asked: PictureArgs,
    ffmpeg: Option<&Path>,
    scratch: &Scratch,
    file: &mut Growing,
) -> Result<()> {
    let times = open(browser, &scratch.page(), asked).await?;
    let Some(ffmpeg) = ffmpeg else {
        let frame = asked.at().map_or(times.len().saturating_sub(1), |at| nearest(&times, at));
        if let Some(at) = asked.at() {
            tell_distance(&times, frame, at);
        }
        return file.write(&picture(browser, frame, asked.size()).await?);
    };

    let Cut { rate, frames } = Cut::of(&times);
    let (pictures, size) = (output::several(frames.len() as u64, "picture"), asked.size());
    output::note(&format!("nappe: drawing {pictures} of {size} for {}", file.path().display()));
    let mut film = Film::start(ffmpeg, rate, scratch, PATIENCE)?;
    for frame in frames {
        film.add(&picture(browser, frame, size).await?).await?;
    }
    film.finish().await?;
    copy(&scratch.film(), file)
}

/// Says where the frame of a picture is, if the run was not there at the time that was asked for.
fn tell_distance(times: &[f64], frame: usize, at: f64) {
    let (Some(shown), Some(first), Some(last)) = (times.get(frame), times.first(), times.last()) else {
        return;
    };
    let apart = (last - first) / (times.len() as f64 - 1.0).max(1.0);
    if at < first - apart || at > last + apart {
        output::note(&format!(
            "nappe: --at {at}: the frames are those from t = {} to {}, and the picture shows t = {}",
            output::moment(*first),
            output::moment(*last),
            output::moment(*shown)
        ));
    }
}

/// Opens the page as large as the picture, in its colours; gives the times of its frames (s), at least one.
async fn open(browser: &mut Browser, page: &Path, asked: PictureArgs) -> Result<Vec<f64>> {
    let Size { width, height } = asked.size();
    let screen = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
    let prefers = json!({ "features": [
        { "name": "prefers-color-scheme", "value": asked.theme().name() },
        { "name": "prefers-reduced-motion", "value": "reduce" },
    ] });
    browser.open_page().await?;
    browser.call("Emulation.setDeviceMetricsOverride", screen).await?;
    browser.call("Emulation.setEmulatedMedia", prefers).await?;
    browser.call("Page.enable", json!({})).await?;
    browser.call("Page.addScriptToEvaluateOnNewDocument", json!({ "source": ALONE })).await?;
    // With a time in its address, it does not play.
    let address = format!("{}#t=0", address(page)?);
    let gone = browser.call("Page.navigate", json!({ "url": address })).await?;
    if let Some(error) = gone["errorText"].as_str() {
        return Err(CliError::failure(format!("the browser cannot open {}: {error}", page.display())));
    }

    let opened = opened(browser).await?;
    let message = opened["message"].as_str().unwrap_or_default();
    let times: Vec<f64> = opened["times"]
        .as_array()
        .map(|times| times.iter().filter_map(Value::as_f64).collect())
        .unwrap_or_default();
    if times.is_empty() || !message.is_empty() {
        let said = printable(if message.is_empty() { "it has no frames" } else { message });
        return Err(CliError::failure(format!("the page of the run cannot be drawn: {said}")));
    }
    Ok(times)
}

/// Waits until the page is there and has drawn its first frame.
async fn opened(browser: &mut Browser) -> Result<Value> {
    let begin = Instant::now();
    loop {
        let trouble = match browser.ask("Runtime.evaluate", evaluation(OPENED)).await {
            Ok(mut answer) if !answer["result"]["value"].is_null() => {
                return Ok(answer["result"]["value"].take());
            }
            Ok(answer) if answer.get("exceptionDetails").is_some() => return Err(thrown(&answer)),
            Ok(_) => None,
            // The empty page, which was asked, went meanwhile.
            Err(Trouble::Refused(said)) => Some(said),
            Err(trouble) => return Err(browser.failed("Runtime.evaluate", trouble).await),
        };
        if begin.elapsed() > PATIENCE {
            let said = trouble.unwrap_or_else(|| "it is not there".to_owned());
            return Err(CliError::failure(format!("the page of the run cannot be drawn: {said}")));
        }
        sleep(INTERVAL).await;
    }
}

/// A frame as PNG.
async fn picture(browser: &mut Browser, frame: usize, size: Size) -> Result<Vec<u8>> {
    let answer = browser.call("Runtime.evaluate", evaluation(&format!("nappe.picture({frame})"))).await?;
    if answer.get("exceptionDetails").is_some() {
        return Err(thrown(&answer));
    }
    let address = answer["result"]["value"].as_str().unwrap_or_default();
    let png = address.strip_prefix("data:image/png;base64,").and_then(|png| STANDARD.decode(png).ok());
    let sides = png.as_deref().and_then(sides);
    match png {
        Some(png) if sides == Some(size) => Ok(png),
        _ => {
            let found = sides.map_or_else(|| "none".to_owned(), |found| format!("one of {found} pixels"));
            let wanted = format!("a picture of {size} pixels");
            Err(CliError::failure(format!("the browser was asked for {wanted}, and drew {found}")))
        }
    }
}

/// Width and height of a file of PNG.
fn sides(png: &[u8]) -> Option<Size> {
    let (sides, _) = png.strip_prefix(PNG)?.split_first_chunk::<8>()?;
    let (words, _) = sides.as_chunks::<4>();
    Some(Size { width: u32::from_be_bytes(words[0]), height: u32::from_be_bytes(words[1]) })
}

/// What has a page compute an expression and wait for it.
fn evaluation(expression: &str) -> Value {
    json!({ "expression": expression, "awaitPromise": true, "returnByValue": true })
}

/// What a page threw, in words.
fn thrown(answer: &Value) -> CliError {
    let details = &answer["exceptionDetails"];
    let said = details["exception"]["description"].as_str().or_else(|| details["text"].as_str());
    let line = said.and_then(|said| said.lines().next()).unwrap_or("it does not say why");
    CliError::failure(format!("the page of the run cannot be drawn: {}", printable(line)))
}

/// The address of a file, for a browser.
fn address(file: &Path) -> Result<String> {
    let whole = std::path::absolute(file).map_err(|error| CliError::file("find", file, &error))?;
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"/-._~".contains(&byte);
    let letter =
        |byte: &u8| if plain(*byte) { char::from(*byte).to_string() } else { format!("%{byte:02X}") };
    let letters: String = whole.as_os_str().as_encoded_bytes().iter().map(letter).collect();
    Ok(format!("file://{letters}"))
}

/// Copies what a file holds, in pieces.
fn copy(from: &Path, to: &mut Growing) -> Result<()> {
    let unread = |error: &std::io::Error| CliError::file("read", from, error);
    let mut film = File::open(from).map_err(|error| unread(&error))?;
    let mut piece = vec![0; 1 << 20];
    loop {
        let read = film.read(&mut piece).map_err(|error| unread(&error))?;
        if read == 0 {
            return Ok(());
        }
        to.write(&piece[..read])?;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_has_no_letter_that_means_something_else_there() {
        let path = Path::new("/a b/é#1?%.png.new.page/page.html");
        let found = address(path).expect("a path");
        assert_eq!(found, "file:///a%20b/%C3%A9%231%3F%25.png.new.page/page.html");
    }

    #[test]
    fn the_sides_of_a_picture_stand_in_its_head() {
        let head = [PNG, &[0, 0, 2, 128, 0, 0, 1, 224, 8, 6]].concat();
        assert_eq!(sides(&head), Some(Size { width: 640, height: 480 }));
        assert_eq!((sides(&head[..20]), sides(b"GIF89a")), (None, None));
    }
}
