//! Where a server listens: at an address of TCP, or at a path of the file system.
//!
//! Enters: what was typed. Leaves: an address, or a socket that listens there.

use std::{
    fmt, io,
    net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr},
    path::PathBuf,
    str::FromStr,
};

/// The port that the server listens on unless told otherwise.
pub const DEFAULT_PORT: u16 = 6277;

/// What stands before a path.
const UNIX: &str = "unix:";

/// Where a server listens.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// Address and port; port 0 takes a free one.
    Tcp(SocketAddr),
    /// Path of a socket that its user alone can open.
    Unix(PathBuf),
}

impl Address {
    /// Whether other machines can reach it.
    pub fn is_remote(&self) -> bool {
        matches!(self, Self::Tcp(address) if !address.ip().is_loopback())
    }

    /// What clients connect to.
    pub fn url(&self) -> String {
        match self {
            Self::Tcp(address) => format!("http://{address}"),
            Self::Unix(_) => self.to_string(),
        }
    }

    /// Where a browser on this machine finds the page; nowhere on a Unix socket.
    pub(crate) fn page_url(&self) -> Option<String> {
        let Self::Tcp(address) = self else { return None };
        let ip = match address.ip() {
            ip if !ip.is_unspecified() => ip,
            IpAddr::V4(_) => Ipv4Addr::LOCALHOST.into(),
            IpAddr::V6(_) => Ipv6Addr::LOCALHOST.into(),
        };
        Some(format!("http://{}/", SocketAddr::new(ip, address.port())))
    }
}

impl Default for Address {
    fn default() -> Self {
        Self::Tcp(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), DEFAULT_PORT))
    }
}

impl From<SocketAddr> for Address {
    fn from(address: SocketAddr) -> Self {
        Self::Tcp(address)
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text.strip_prefix(UNIX).map(|path| path.strip_prefix("//").unwrap_or(path)) {
            Some("") => Err("after unix: stands the path of a socket".to_owned()),
            Some(path) => Ok(Self::Unix(path.into())),
            None => tcp(text).map(Self::Tcp).ok_or_else(|| {
                format!("an address and a port are needed, as 127.0.0.1:{DEFAULT_PORT} or localhost:{DEFAULT_PORT}, or unix:PATH")
            }),
        }
    }
}

/// An address and a port, perhaps as clients write them; `localhost` is the first of the two addresses that it means.
fn tcp(text: &str) -> Option<SocketAddr> {
    let text = text.strip_prefix("http://").unwrap_or(text);
    match text.strip_prefix("localhost:") {
        Some(port) => Some(SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port.parse().ok()?)),
        None => text.parse().ok(),
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Tcp(address) => address.fmt(f),
            Self::Unix(path) => write!(f, "{UNIX}{}", path.display()),
        }
    }
}

/// A socket file. Dropping it removes it.
#[cfg(unix)]
#[derive(Debug)]
pub(crate) struct SocketFile {
    path: PathBuf,
    /// Device and number, which tell it from another server's at the same path.
    place: (u64, u64),
}

#[cfg(unix)]
impl SocketFile {
    /// Listens at a path, for its user alone, from the first moment on. A socket that nobody listens at any more is
    /// replaced.
    ///
    /// # Errors
    /// If somebody listens there, something else is there, or the system refuses.
    pub(crate) fn bind(path: &std::path::Path) -> io::Result<(Self, std::os::unix::net::UnixListener)> {
        use std::{
            fs::{self, DirBuilder, Permissions},
            os::unix::{
                fs::{DirBuilderExt as _, FileTypeExt as _, PermissionsExt as _},
                net::{UnixListener, UnixStream},
            },
        };

        if let Ok(there) = fs::symlink_metadata(path) {
            let is_left = there.file_type().is_socket() && UnixStream::connect(path).is_err();
            if !is_left {
                return Err(io::ErrorKind::AddrInUse.into());
            }
        }

        // Made where nobody else can enter, and moved when nobody else can open it.
        let folder = path.with_extension(format!("{}.new", std::process::id()));
        DirBuilder::new().mode(0o700).create(&folder)?;
        let made = (|| {
            let inside = folder.join("socket");
            let listener = UnixListener::bind(&inside)?;
            listener.set_nonblocking(true)?;
            fs::set_permissions(&inside, Permissions::from_mode(0o600))?;
            fs::rename(&inside, path)?;
            Ok((Self { path: path.to_owned(), place: place(path)? }, listener))
        })();
        fs::remove_dir_all(&folder)?;
        made
    }
}

#[cfg(unix)]
impl Drop for SocketFile {
    fn drop(&mut self) {
        if place(&self.path).is_ok_and(|place| place == self.place) {
            let _ = std::fs::remove_file(&self.path);
        }
    }
}

#[cfg(unix)]
fn place(path: &std::path::Path) -> io::Result<(u64, u64)> {
    use std::os::unix::fs::MetadataExt as _;
    let metadata = std::fs::symlink_metadata(path)?;
    Ok((metadata.dev(), metadata.ino()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_read_and_written_alike() {
        for text in ["127.0.0.1:0", "[::1]:6277", "unix:/run/nappe.sock", "unix:here.sock"] {
            assert_eq!(text.parse::<Address>().expect(text).to_string(), text);
        }
        assert_eq!("unix:///run/nappe.sock".parse(), Ok(Address::Unix("/run/nappe.sock".into())));
        assert!("0.0.0.0:1".parse::<Address>().expect("an address").is_remote());
        assert!(!"unix:x".parse::<Address>().expect("an address").is_remote());
        for same in ["localhost:6277", "http://127.0.0.1:6277", "http://localhost:6277"] {
            assert_eq!(same.parse(), Ok(Address::default()), "{same}");
        }
        for bad in
            ["", "unix:", "localhost", "localhost:", "localhost:66000", "https://127.0.0.1:1", "127.0.0.1"]
        {
            assert!(bad.parse::<Address>().is_err(), "{bad}");
        }
    }

    #[test]
    fn a_browser_of_this_machine_opens_an_address_that_it_can_reach() {
        let page = |text: &str| text.parse::<Address>().expect(text).page_url();
        for (address, url) in [
            ("127.0.0.1:6277", "http://127.0.0.1:6277/"),
            ("0.0.0.0:6277", "http://127.0.0.1:6277/"),
            ("[::]:6277", "http://[::1]:6277/"),
            ("192.0.2.7:6277", "http://192.0.2.7:6277/"),
        ] {
            assert_eq!(page(address).as_deref(), Some(url));
        }
        assert_eq!(page("unix:nappe.sock"), None);
    }

    #[cfg(unix)]
    #[test]
    fn a_socket_is_its_users_alone_and_goes_with_its_server() {
        use std::os::unix::fs::PermissionsExt as _;
        let path = std::env::temp_dir().join(format!("nappe-socket-{}", std::process::id()));
        let (file, listener) = SocketFile::bind(&path).expect("bound");
        let mode = std::fs::metadata(&path).expect("it is there").permissions().mode();
        assert_eq!(mode & 0o777, 0o600);
        let refused = SocketFile::bind(&path).expect_err("somebody listens there");
        assert_eq!(refused.kind(), io::ErrorKind::AddrInUse);

        // Whoever was killed leaves a socket at which nobody listens.
        drop(listener);
        let (second, _listener) = SocketFile::bind(&path).expect("replaced");
        drop(file);
        assert!(path.exists(), "it is the second's by now");
        drop(second);
        assert!(!path.exists());
    }
}
