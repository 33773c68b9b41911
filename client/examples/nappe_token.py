"""Finds what a server asks for: the token that it left for clients of the same user. See docs/service.md."""

import fcntl
import os
import tempfile


def token_file(server):
    """The file in which a server of the same user on this machine left its token, or None."""
    if "NAPPE_TOKEN_FILE" in os.environ:
        return os.environ["NAPPE_TOKEN_FILE"]
    port, user = server.rpartition(":")[2], os.getuid()
    runtime = [os.environ.get("XDG_RUNTIME_DIR", ""), f"/run/user/{user}"]
    folders = [f"{folder}/nappe" for folder in runtime] + [f"{tempfile.gettempdir()}/nappe-{user}"]
    for path in (f"{folder}/{port}.token" for folder in folders):
        if not os.path.isfile(path) or os.stat(path).st_uid != user:
            continue
        with open(path) as file:
            try:
                fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
            except BlockingIOError:  # its server lives and holds the lock
                if file.read().split()[1] in (server, f"0.0.0.0:{port}"):
                    return path
    return None


def token(server):
    """What a call shows to the server: metadata."""
    path = token_file(server)
    if path is None:
        return []
    with open(path) as file:
        return [("authorization", "Bearer " + file.readline().strip())]
