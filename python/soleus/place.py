"""Where a domain is, and the files that say who lives in it.

The same as `soleus-launch domain --domain NAME` prints; docs/reliability.md has the reasons.
"""

import errno
import fcntl
import os
import pathlib
import re
import stat
import time

RUNTIME_VARIABLE = "SOLEUS_RUNTIME_DIR"
# The longest path of a socket, and digits and suffix that iceoryx2 adds to root and prefix (bytes).
SOCKET_PATH_MAX = 107
SOCKET_NAME_MAX = 34 + len(".event")
# How long one waits for another of its kind: one that is just being stopped needs a moment (s).
OTHER_ENDS_S = 1.0


class Unusable(Exception):
    """The runtime folder is not ours alone, or a name cannot be."""


def fnv_1a(data):
    """The 32-bit FNV-1a hash (Fowler, Noll, Vo)."""
    value = 0x811C9DC5
    for byte in data:
        value = ((value ^ byte) * 0x01000193) & 0xFFFFFFFF
    return value


class Place:
    """A domain's folder and prefix. Makes nothing."""

    def __init__(self, domain):
        if not re.fullmatch(r"[a-z0-9-]{1,32}", domain):
            raise Unusable(f"domain `{domain}`: 1 to 32 lower-case letters, digits and `-`")
        named = os.environ.get(RUNTIME_VARIABLE, "")
        path = pathlib.Path(named or f"/tmp/soleus-{os.geteuid()}")
        if not path.is_absolute():
            raise Unusable(f"{RUNTIME_VARIABLE}={named}: name an absolute path")
        # Not by the links through which it may be named: they may lead elsewhere tomorrow.
        self.runtime = path.parent.resolve() / path.name
        user = str(os.geteuid())
        if named:
            user += f"-{fnv_1a(os.fsencode(self.runtime)):08x}"
        self.domain = domain
        self.root = self.runtime / domain
        self.prefix = f"soleus_{user}_{domain}_"
        length = len(os.fsencode(self.root)) + 1 + len(self.prefix) + SOCKET_NAME_MAX
        if length > SOCKET_PATH_MAX:
            raise Unusable(f"{self.root}: paths of sockets in it would have {length} bytes, {SOCKET_PATH_MAX} are possible")

    @property
    def ready_file(self):
        """Locked by the owner while the domain is complete."""
        return self.root / "ready"

    def member_file(self, process):
        """Locked by the one living process of a kind."""
        return self.root / "members" / process.name.lower()

    def check(self):
        """Whether there is a runtime folder; one that is not a real folder of ours alone is refused."""
        try:
            found = os.lstat(self.runtime)
        except FileNotFoundError:
            return False
        if not stat.S_ISDIR(found.st_mode):
            raise Unusable(f"{self.runtime} is not a real folder: remove it, or name another one in {RUNTIME_VARIABLE}")
        if found.st_uid != os.geteuid():
            raise Unusable(f"{self.runtime} belongs to user {found.st_uid}: name another one in {RUNTIME_VARIABLE}")
        if stat.S_IMODE(found.st_mode) != 0o700:
            raise Unusable(f"{self.runtime} has mode {stat.S_IMODE(found.st_mode):04o}: chmod 700 {self.runtime}")
        return True

    def owner(self):
        """The line that the living owner wrote; None if none lives."""
        return _living(self.ready_file) if self.check() else None


def _living(path):
    """The whole line of who holds the lock of a file; None if nobody does."""
    try:
        descriptor = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    with os.fdopen(descriptor, "rb") as file:
        try:
            fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
        except OSError as error:
            if error.errno not in (errno.EWOULDBLOCK, errno.EACCES):
                raise
            line = file.read().decode(errors="replace")
            # A line without its end is still being written.
            return line.rstrip("\n") if line.endswith("\n") else None
    return None


class Life:
    """The lock that makes a process the one of its kind, held until it ends."""

    def __init__(self, path):
        self.path = path
        self.descriptor = None
        end = time.monotonic() + OTHER_ENDS_S
        while True:
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_NOFOLLOW | os.O_CLOEXEC, 0o600)
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                taken = error.errno in (errno.EWOULDBLOCK, errno.EACCES)
                other = os.pread(descriptor, 100, 0).decode(errors="replace").split()
                os.close(descriptor)
                if not taken:
                    raise
                if time.monotonic() >= end:
                    raise Taken(other[0] if other else "?") from None
                time.sleep(0.002)
                continue
            # Who left removed the file: a lock on one without a name is worth nothing.
            if self._is_named(descriptor):
                break
            os.close(descriptor)
        os.ftruncate(descriptor, 0)
        os.write(descriptor, f"{os.getpid()} {time.time_ns()}\n".encode())
        self.descriptor = descriptor

    def _is_named(self, descriptor):
        try:
            return os.fstat(descriptor).st_ino == os.lstat(self.path).st_ino
        except FileNotFoundError:
            return False

    def end(self, badly):
        """Lets go. In order, the file goes too; else it stays, and all hear of a death."""
        if self.descriptor is None:
            return
        if not badly:
            os.ftruncate(self.descriptor, 0)
            if self._is_named(self.descriptor):
                os.unlink(self.path)
        fcntl.flock(self.descriptor, fcntl.LOCK_UN)
        os.close(self.descriptor)
        self.descriptor = None


class Taken(Exception):
    """Another one lives; the text is its process id."""
