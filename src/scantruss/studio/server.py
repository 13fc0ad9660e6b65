"""The server of the studio: viser on one address, behind a guard against other sites and, beyond this machine, a token."""

from __future__ import annotations

import gzip
import hmac
import http
import secrets
import socket
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from http.cookies import CookieError, SimpleCookie
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import parse_qs, urlsplit

from ..errors import InputError, how_to_install

if TYPE_CHECKING:
    from .browsers import Browsers
    from .view import StudioView

LOOPBACK = ("127.0.0.1", "localhost", "::1")
SOMEWHERE = {
    "0.0.0.0": "192.0.2.1",
    "::": "2001:db8::1",
}  #: addresses of examples (RFC 5737, 3849), by what listens everywhere
COOKIE = "scantruss_studio"
BROWSER_KEY = "scantruss_browser"
PAGE_SCRIPTS = tuple(
    Path(__file__).with_name(name)
    for name in ("page_script.js", "page_keys.js", "page_presses.js", "page_connection.js")
)
ALIVE = "/alive"  #: what a page asks for to know that the server is there
STORAGE_PATIENCE = 5.0  #: how long a browser may take to say who it is [s]
Handler = Callable[[Any, Any], Any]


def check_viser() -> None:
    """Refuse to start without viser.

    Raises
    ------
    InputError
        It is not installed; the message has the command that installs it.
    """
    if find_spec("viser") is None:
        raise InputError(f"the studio needs viser, which is not installed; install it with: {how_to_install('studio')}")


class Guard:
    """Judges requests: whether they come from our own page, and from somebody who has the token.

    Parameters
    ----------
    host : str
        Address that the server listens on.
    """

    def __init__(self, host: str) -> None:
        self._pages: dict[bool, tuple[bytes, bytes]] = {}  # as viser has them and as they are served
        self.name = secrets.token_urlsafe(8)  #: by which a page knows that the server was started again
        self.token = "" if host in LOOPBACK else secrets.token_urlsafe(24)

    def refusal(self, path: str, headers: Any) -> str:
        """Return why a request is refused; "" where it is not.

        Parameters
        ----------
        path : str
            Of the request, with its query.
        headers : mapping
            Of the request.
        """
        host = headers.get("Host", "")
        if not self.token and urlsplit(f"//{host}").hostname not in LOOPBACK:  # a name that was made to point here
            return "this studio answers to the machine it runs on only"
        origin = headers.get("Origin", "")
        if origin and urlsplit(origin).netloc != host:
            return "requests of other sites are refused"
        if headers.get("Upgrade", "").lower() == "websocket" and not origin:
            return "a page must say where it comes from"
        if self.token and not hmac.compare_digest(self.token.encode(), self._given(path, headers).encode()):
            return "the token is missing or wrong; open the address that scantruss studio printed"
        return ""

    def _add_script(self, answer: Any) -> None:
        """Give a page our own scripts; pages that were served before are remembered."""
        is_packed = answer.headers.get("Content-Encoding") == "gzip"
        if (kept := self._pages.get(is_packed)) is None or kept[0] != answer.body:
            page = gzip.decompress(answer.body) if is_packed else answer.body
            scripts = b"".join(b"<script>{" + each.read_bytes() + b"}</script>" for each in PAGE_SCRIPTS)
            page = page.replace(b"<head>", b"<head>" + scripts, 1)
            kept = self._pages[is_packed] = (answer.body, gzip.compress(page) if is_packed else page)
        answer.body = kept[1]
        del answer.headers["Content-Length"]
        answer.headers["Content-Length"] = str(len(answer.body))

    @staticmethod
    def _given(path: str, headers: Any) -> str:
        """Return the token of a request: of its address, or of the cookie that the first answer set."""
        if words := parse_qs(urlsplit(path).query).get("token"):
            return words[0]
        try:
            found = SimpleCookie(headers.get("Cookie", "")).get(COOKIE)
        except CookieError:
            return ""
        return "" if found is None else found.value

    def around(self, inner: Handler) -> Handler:
        """Return the handler of requests with this guard before it."""
        from websockets.datastructures import Headers
        from websockets.http11 import Response

        def handle(connection: Any, request: Any) -> Any:
            if words := self.refusal(request.path, request.headers):
                head = Headers({"Content-Type": "text/plain; charset=utf-8", "Connection": "close"})
                return Response(http.HTTPStatus.FORBIDDEN, "Forbidden", head, f"{words}\n".encode())
            if urlsplit(request.path).path == ALIVE:
                head = Headers({"Content-Type": "text/plain; charset=utf-8", "Cache-Control": "no-store"})
                return Response(http.HTTPStatus.OK, "OK", head, self.name.encode())
            answer = inner(connection, request)
            if answer is not None:
                if answer.headers.get("Content-Type", "").startswith("text/html"):
                    self._add_script(answer)
                answer.headers["Referrer-Policy"] = "no-referrer"
                answer.headers["X-Frame-Options"] = "DENY"
                if self.token:
                    answer.headers["Set-Cookie"] = f"{COOKIE}={self.token}; HttpOnly; SameSite=Strict; Path=/"
            return answer

        return handle


@contextmanager
def _guarded(guard: Guard) -> Iterator[None]:
    """Put the guard before all that viser serves while it starts: it has no place of its own for one."""
    import websockets.asyncio.server as serving

    plain = serving.serve
    used: list[bool] = []

    def serve(*arguments: Any, **options: Any) -> Any:
        used.append(True)
        return plain(*arguments, **options | {"process_request": guard.around(options["process_request"])})

    serving.serve = serve
    try:
        yield
    finally:
        serving.serve = plain
    if not used:
        raise InputError("this version of viser cannot be guarded; install viser 1.1")


@contextmanager
def _silent() -> Iterator[None]:
    """Keep viser from its greeting, an address that lacks the token."""
    import rich

    console = rich.get_console()
    before, console.quiet = console.quiet, True
    try:
        yield
    finally:
        console.quiet = before


def start_server(host: str, port: int) -> tuple[Any, Guard]:
    """Start the server.

    Returns
    -------
    (viser.ViserServer, Guard)

    Raises
    ------
    InputError
        viser is not installed, or nothing can be served there.
    """
    check_viser()
    import viser

    with socket.socket(
        socket.AF_INET6 if ":" in host else socket.AF_INET
    ) as trial:  # viser takes another port without a word
        try:
            trial.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            trial.bind((host, port))
        except OSError as error:
            raise InputError(
                f"cannot serve on {host} port {port}: {error.strerror or error}; choose another with --port"
            ) from None
        port = trial.getsockname()[1]
    guard = Guard(host)
    with _guarded(guard), _silent():
        server = viser.ViserServer(host=host, port=port, label="ScanTruss studio", verbose=False)
    server.request_share_url = _no_tunnel  # a page could else ask for a way in from the network
    return server, guard


def address_to_open(host: str, port: int, token: str) -> str:
    """Return the address at which a browser finds the studio: where it listens to all of this machine's, the one that others reach."""
    if host in LOOPBACK:
        host = "localhost"
    elif host in SOMEWHERE:
        host = _own_address(host)
    shown = f"[{host}]" if ":" in host else host
    return f"http://{shown}:{port}/" + (f"?token={token}" if token else "")


def _own_address(everywhere: str) -> str:
    """Return the address of this machine in its network; its name where it is in none."""
    family = socket.AF_INET6 if ":" in everywhere else socket.AF_INET
    with socket.socket(family, socket.SOCK_DGRAM) as trial:
        try:
            trial.connect((SOMEWHERE[everywhere], 9))  # of datagrams: nothing is sent
            return str(trial.getsockname()[0])
        except OSError:
            return socket.gethostname()


def serve_browsers(server: Any, browsers: Browsers) -> Pages:
    """Give each page the session of its browser, which a key in the storage of the browser tells."""
    pages = Pages(server, browsers)
    server.on_client_connect(pages.begin)
    server.on_client_disconnect(pages.end)
    return pages


class Pages:
    """The open pages of a server."""

    def __init__(self, server: Any, browsers: Browsers) -> None:
        self.server, self._browsers = server, browsers
        self._views: dict[int, tuple[str, StudioView]] = {}
        self._stopping = False

    def begin(self, client: Any) -> None:
        """Make the page of a browser that has come."""
        from .view import StudioView

        try:
            known = client.local_storage.get_item(BROWSER_KEY, timeout=STORAGE_PATIENCE)
        except (RuntimeError, TimeoutError):  # closed already, or a browser that keeps nothing
            known = None
        try:
            key, session = self._browsers.join(known)
        except InputError as error:
            client.gui.add_markdown(f"**Refused:** {error}")
            return
        try:
            client.local_storage.set_item(BROWSER_KEY, key)
            self._views[client.client_id] = (key, StudioView(session, client))
        except BaseException:
            self._browsers.leave(key)
            raise
        if self._stopping or client.client_id not in self.server.get_clients():  # closed while its page was being made
            self.end(client)

    def end(self, client: Any) -> None:
        """Let go of the page of a browser that has left."""
        self._close(client.client_id)

    def stop(self) -> None:
        """Let go of all pages and stop the server: no page writes to a server that is no more."""
        self._stopping = True
        for client in list(self._views):
            self._close(client)
        self.server.stop()

    def _close(self, client: int) -> None:
        key, view = self._views.pop(client, ("", None))
        if view is not None:
            view.close()
            self._browsers.leave(key)


def _no_tunnel(*_: Any, **__: Any) -> None:
    """Open no tunnel."""
