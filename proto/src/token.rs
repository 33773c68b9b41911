//! The token that a server asks for, and the file in which it leaves it for clients of the same user.
//!
//! Enters: a token and the address of a server, or the address that a client calls. Leaves: a file that is there as
//! long as its server lives, or the token of a server that lives.
//!
//! The file is `PORT.token` in a folder that the user alone can enter: `nappe` in the user's runtime directory
//! (`XDG_RUNTIME_DIR`, `/run/user/UID`), or else `nappe-UID` among the temporary files. Its first line is the
//! token, its second the address that the server listens on. Its server holds a lock on it (`flock`): a file
//! without a lock was left by a server that is gone, and is nobody's token, since anybody may have the port now.

use std::{
    env, fmt,
    fs::{self, File, TryLockError},
    io::{self, Read as _, Write as _},
    net::{IpAddr, Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
};

use crate::permissions::{check_readers, is_private, is_same, make_private, own_uid, private_file};

/// Fewest characters of a token, and most.
const LENGTHS: std::ops::RangeInclusive<usize> = 16..=512;
/// Most bytes that are read of a file.
const FILE_BYTES: u64 = 4096;

/// What a caller shows to be let in. Never shown itself: its `Debug` says nothing of it.
#[derive(Clone, PartialEq, Eq)]
pub struct Token(String);

impl Token {
    /// The token in a text; blanks and line ends around it do not count.
    ///
    /// # Errors
    /// Unless it is 16 to 512 printable characters of ASCII without blanks. The error does not tell the text.
    pub fn parse(text: &str) -> io::Result<Self> {
        let text = text.trim();
        if LENGTHS.contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_graphic()) {
            return Ok(Self(text.to_owned()));
        }
        let (least, most) = (LENGTHS.start(), LENGTHS.end());
        Err(invalid(format!("a token has {least} to {most} printable characters of ASCII and no blanks")))
    }

    /// The token in the first line of a file.
    ///
    /// # Errors
    /// If the file cannot be read, every user of the machine may read or write it, or it holds no token; the path is
    /// in the error.
    pub fn read(path: &Path) -> io::Result<Self> {
        let named = |error: io::Error| {
            io::Error::new(error.kind(), format!("token file {}: {error}", path.display()))
        };
        let read = |mut file: File| check_readers(&file, path).and_then(|()| text_of(&mut file));
        let text = File::open(path).and_then(read).map_err(named)?;
        Self::parse(text.lines().next().unwrap_or_default()).map_err(named)
    }

    /// The text itself, to send or to compare.
    pub fn reveal(&self) -> &str {
        &self.0
    }
}

impl fmt::Debug for Token {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Token(secret)")
    }
}

/// The file of a server that lives. Dropping it removes it.
#[derive(Debug)]
pub struct TokenFile {
    path: PathBuf,
    /// Holds the lock.
    file: File,
    token: Token,
    address: SocketAddr,
}

impl TokenFile {
    /// Leaves a token for clients of the same user, and forgets those of servers that are gone.
    ///
    /// # Errors
    /// If there is no folder that this user alone can enter, or the file cannot be written.
    pub fn leave(token: &Token, address: SocketAddr) -> io::Result<Self> {
        let mut refused = None;
        for folder in folders()? {
            match Self::leave_in(&folder, token, address) {
                Ok(left) => return Ok(left),
                Err(error) => {
                    let told = format!("{}: {error}", folder.display());
                    refused = Some(io::Error::new(error.kind(), told));
                }
            }
        }
        Err(refused.unwrap_or_else(|| io::ErrorKind::NotFound.into()))
    }

    fn leave_in(folder: &Path, token: &Token, address: SocketAddr) -> io::Result<Self> {
        make_private(folder)?;
        sweep(folder);
        let path = folder.join(format!("{}.token", address.port()));

        // Whole and locked before it has its name.
        let new = folder.join(format!("{}.{}.new", address.port(), std::process::id()));
        let mut file = private_file(&new)?;
        file.write_all(format!("{}\n{address}\n", token.reveal()).as_bytes())?;
        file.try_lock().map_err(io::Error::from)?;
        fs::rename(&new, &path)?;
        Ok(Self { path, file, token: token.clone(), address })
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it is still there.
    pub fn is_there(&self) -> bool {
        is_same(&self.file, &self.path)
    }

    /// Leaves it again if it is gone: a runtime directory goes away when its user logs out.
    ///
    /// # Errors
    /// As [`Self::leave`].
    pub fn renew(&mut self) -> io::Result<()> {
        if !self.is_there() {
            *self = Self::leave(&self.token, self.address)?;
        }
        Ok(())
    }
}

impl Drop for TokenFile {
    fn drop(&mut self) {
        // Another server of the same port may have left its own by now.
        if self.is_there() {
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// A server of this user on this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LocalServer {
    /// The address that it listens on, as a client reaches it.
    pub address: SocketAddr,
    /// What it asks for.
    pub token: Token,
}

/// The servers of this user that live and listen on `port`.
pub fn local_servers(port: u16) -> Vec<LocalServer> {
    let folders = folders().unwrap_or_default();
    folders.iter().filter_map(|folder| live(&folder.join(format!("{port}.token")))).collect()
}

/// A folder that this user alone can enter, for files that live as long as their program.
///
/// # Errors
/// If there is none and none can be made.
pub fn private_folder() -> io::Result<PathBuf> {
    let mut folders = folders()?;
    folders
        .iter()
        .position(|folder| make_private(folder).is_ok())
        .map(|found| folders.swap_remove(found))
        .ok_or(io::Error::new(io::ErrorKind::NotFound, "there is no folder that this user alone can enter"))
}

/// Reads the file of a server that lives.
fn live(path: &Path) -> Option<LocalServer> {
    let mut file = File::open(path).ok()?;
    if !is_private(&file.metadata().ok()?) || !matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock))
    {
        return None;
    }

    let text = text_of(&mut file).ok()?;
    let mut lines = text.lines();
    let token = Token::parse(lines.next()?).ok()?;
    let address: SocketAddr = lines.next()?.parse().ok()?;
    let ip = match address.ip() {
        ip if !ip.is_unspecified() => ip,
        IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
        IpAddr::V6(_) => std::net::Ipv6Addr::LOCALHOST.into(),
    };
    Some(LocalServer { address: SocketAddr::new(ip, address.port()), token })
}

fn text_of(file: &mut File) -> io::Result<String> {
    let mut text = String::new();
    file.take(FILE_BYTES).read_to_string(&mut text)?;
    Ok(text)
}

/// Removes the files of servers that are gone.
fn sweep(folder: &Path) {
    let files = fs::read_dir(folder).into_iter().flatten().filter_map(Result::ok);
    for path in files.map(|entry| entry.path()).filter(|path| path.extension().is_some_and(|e| e == "token"))
    {
        if File::open(&path).is_ok_and(|file| file.try_lock().is_ok()) {
            let _ = fs::remove_file(path);
        }
    }
}

/// Folders in which the file may be, the best first.
fn folders() -> io::Result<Vec<PathBuf>> {
    let uid = own_uid()?;
    let runtime = env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from).filter(|path| path.is_absolute());
    let usual = Some(PathBuf::from(format!("/run/user/{uid}"))).filter(|path| path.is_dir());
    let mut folders: Vec<_> = runtime.into_iter().chain(usual).map(|path| path.join("nappe")).collect();
    folders.dedup();
    folders.push(env::temp_dir().join(format!("nappe-{uid}")));
    Ok(folders)
}

fn invalid(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

#[cfg(all(test, unix))]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;

    const TEXT: &str = "0123456789abcdef0123456789abcdef";

    fn folder(name: &str) -> PathBuf {
        let folder = env::temp_dir().join(format!("nappe-token-{}-{name}", std::process::id()));
        let _ = fs::remove_dir_all(&folder);
        folder
    }

    fn mode(path: &Path) -> u32 {
        fs::metadata(path).expect("it is there").permissions().mode() & 0o777
    }

    #[test]
    fn a_token_is_one_long_word_and_is_never_shown() {
        let token = Token::parse(&format!(" {TEXT}\n")).expect("a token");
        assert_eq!((token.reveal(), format!("{token:?}").as_str()), (TEXT, "Token(secret)"));
        let long = "x".repeat(513);
        for bad in ["", "short", "0123456789abcde f0123456789abcdef", "0123456789abcdé0123456789", &long] {
            let error = Token::parse(bad).expect_err(bad).to_string();
            assert!(bad.len() < 6 || !error.contains(bad), "{error}");
        }
    }

    #[test]
    fn a_live_server_is_found_by_its_port_and_a_dead_one_is_not() {
        let folder = folder("live");
        let token = Token::parse(TEXT).expect("a token");
        let address: SocketAddr = "127.0.0.1:6277".parse().expect("an address");
        let left = TokenFile::leave_in(&folder, &token, address).expect("left");
        assert_eq!((mode(&folder), mode(left.path())), (0o700, 0o600));
        assert_eq!(live(left.path()), Some(LocalServer { address, token: token.clone() }));

        // One that was killed leaves a file without a lock.
        let dead = folder.join("7000.token");
        fs::write(&dead, format!("{TEXT}\n127.0.0.1:7000\n")).expect("written");
        fs::set_permissions(&dead, fs::Permissions::from_mode(0o600)).expect("private");
        assert_eq!(live(&dead), None);

        // The next server forgets it, and leaves the living one alone.
        let everywhere = "0.0.0.0:6278".parse().expect("an address");
        let second = TokenFile::leave_in(&folder, &token, everywhere).expect("left");
        assert!(!dead.exists() && left.is_there());
        assert_eq!(live(second.path()).map(|server| server.address), "127.0.0.1:6278".parse().ok());

        let path = left.path().to_owned();
        drop((left, second));
        assert!(!path.exists(), "it goes with its server");
        fs::remove_dir_all(folder).expect("empty");
    }

    #[test]
    fn what_others_can_read_or_enter_is_not_trusted() {
        let folder = folder("open");
        fs::create_dir(&folder).expect("made");
        fs::set_permissions(&folder, fs::Permissions::from_mode(0o755)).expect("open to all");
        let token = Token::parse(TEXT).expect("a token");
        let address: SocketAddr = "127.0.0.1:6277".parse().expect("an address");
        TokenFile::leave_in(&folder, &token, address).expect_err("others can enter the folder");

        fs::set_permissions(&folder, fs::Permissions::from_mode(0o700)).expect("closed");
        let left = TokenFile::leave_in(&folder, &token, address).expect("left");
        fs::set_permissions(left.path(), fs::Permissions::from_mode(0o644)).expect("open to all");
        assert_eq!(live(left.path()), None, "others can read the file");
        drop(left);

        let link = folder.join("link");
        std::os::unix::fs::symlink(&folder, &link).expect("a link");
        TokenFile::leave_in(&link, &token, address).expect_err("a link leads anywhere");
        fs::remove_dir_all(folder).expect("removed");
    }

    #[test]
    fn a_file_that_every_user_may_read_is_refused_with_the_command_that_mends_it() {
        let folder = folder("shared");
        fs::create_dir(&folder).expect("made");
        let file = folder.join("my.token");
        fs::write(&file, format!("{TEXT}\n")).expect("written");
        for (mode, is_allowed) in [(0o644, false), (0o602, false), (0o640, true), (0o600, true)] {
            fs::set_permissions(&file, fs::Permissions::from_mode(mode)).expect("set");
            let read = Token::read(&file).map_err(|error| error.to_string());
            let mends = format!("`chmod 600 {}`", file.display());
            match read {
                Ok(token) => assert!(is_allowed && token.reveal() == TEXT, "{mode:o}"),
                Err(told) => assert!(!is_allowed && told.contains(&mends) && !told.contains(TEXT), "{told}"),
            }
        }
        fs::remove_dir_all(folder).expect("removed");
    }
}
