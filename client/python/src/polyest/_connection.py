"""The channel to a daemon: its security, the token that goes with each call, its limits."""

from __future__ import annotations

import ipaddress
import os
import re
import ssl
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Optional, Union

import grpc

from polyest._request import number, with_arguments
from polyest.errors import InvalidInput, PolyestError, Unavailable, WrongType, of_rpc

File = Union[str, "os.PathLike[str]"]

_PORT = re.compile(r"0*[0-9]{1,5}")
# The largest message taken from the daemon, bytes; gRPC's default of 4 MB is too little.
_MAX_RESPONSE_BYTES = 64 << 20


@dataclass(frozen=True)
class ConnectionOptions:
    """How to reach a daemon; see `polyest.connect`."""

    server: str
    token: Optional[str] = None
    token_file: Optional[File] = None
    ca: Optional[File] = None
    certificate: Optional[File] = None
    key: Optional[File] = None
    server_name: Optional[str] = None
    timeout_s: Optional[float] = None

    def __post_init__(self) -> None:
        """Raises InvalidInput for what gRPC would take otherwise, or refuse only at a call."""
        host, _, port = str(self.server).rpartition(":")
        if _is_ipv6(str(self.server)) or _is_ipv6(host):
            raise _invalid("server", f'"{self.server}" must be HOST:PORT, an IPv6 address in '
                           "brackets, as in [::1]:50051")
        if "/" in str(self.server):
            raise _invalid("server", f'"{self.server}" must be HOST:PORT, the port from 1 to 65535, '
                           'without "http://" or a path')
        if not host or not _PORT.fullmatch(port) or not 1 <= int(port[-5:]) <= 65535:
            raise _invalid("server", f'"{self.server}" must be HOST:PORT, the port from 1 to 65535')
        if self.token is not None and not isinstance(self.token, str):
            # What it is stays secret.
            raise WrongType(f"token: a value of the type {type(self.token).__name__} must be a "
                            "text", field="token", rule="must be a text")
        if self.timeout_s is not None and not number("timeout_s", self.timeout_s) >= 0:
            raise _invalid("timeout_s", f"{self.timeout_s} must be ≥ 0")

    @property
    def uses_tls(self) -> bool:
        """Whether the connection is encrypted."""
        return any(value is not None for value in (self.ca, self.certificate, self.server_name))

    def authorization(self) -> Optional[str]:
        """Returns the header by which the daemon knows the caller.

        A token's file is read for each call, so that a new token takes effect at once.
        """
        token = self.token
        if self.token_file is not None:
            token = _text("token_file", self.token_file).decode().strip()
        if token is None:
            return None
        if not token or not all("!" <= letter <= "~" for letter in token):
            raise _invalid("token", "must be one word of printable ASCII characters")
        return f"Bearer {token}"

    def metadata(self) -> tuple[tuple[str, str], ...]:
        """Returns the metadata of a call."""
        authorization = self.authorization()
        return () if authorization is None else (("authorization", authorization),)

    def channel_arguments(self) -> list[tuple[str, Any]]:
        """Returns gRPC's options of the channel."""
        arguments: list[tuple[str, Any]] = [
            ("grpc.max_receive_message_length", _MAX_RESPONSE_BYTES),
            ("grpc.max_send_message_length", -1),
            ("grpc.keepalive_time_ms", 20_000),
            ("grpc.keepalive_timeout_ms", 20_000),
            ("grpc.keepalive_permit_without_calls", 0),
            ("grpc.http2.max_pings_without_data", 0),
            # The channel has a connection of its own, which other channels cannot block.
            ("grpc.use_local_subchannel_pool", 1),
            # A stream that reconnects has its own delays; those of the channel must not be longer.
            ("grpc.initial_reconnect_backoff_ms", 100),
            ("grpc.min_reconnect_backoff_ms", 5_000),
            ("grpc.max_reconnect_backoff_ms", 1_000),
        ]
        if self.server_name is not None:
            arguments.append(("grpc.ssl_target_name_override", self.server_name))
        if self.authorization() is not None and not self.uses_tls:
            # An HTTP proxy would see the token.
            arguments.append(("grpc.enable_http_proxy", 0))
        return arguments

    def credentials(self) -> Optional[grpc.ChannelCredentials]:
        """Returns the credentials of TLS; None without TLS. Raises InvalidInput."""
        authorization = self.authorization()
        if (self.certificate is None) != (self.key is None):
            raise _invalid("certificate", "a certificate and its key must be given together")
        if not self.uses_tls:
            if authorization is not None and not _is_loopback(self.server):
                raise _invalid("token", f"{self.server} is not a loopback address; tokens are sent "
                               "only over TLS (ca=…)")
            return None
        ca = None if self.ca is None else _certificates("ca", self.ca)
        if self.certificate is None or self.key is None:
            return grpc.ssl_channel_credentials(ca)
        certificate = _certificates("certificate", self.certificate)
        return grpc.ssl_channel_credentials(ca, _key(self.key, self.certificate), certificate)

    def error_of(self, error: grpc.RpcError, request: Any = None) -> PolyestError:
        """Returns the exception of a failed call, with the server's name if there is none.

        request: the type of the call's request, whose fields are then named as arguments.
        """
        found = of_rpc(error)
        if request is not None:
            found = with_arguments(found, request.DESCRIPTOR)
        if isinstance(found, Unavailable) and self.server not in found.message:
            return Unavailable(f"{self.server}: {found.message}", reason=found.reason,
                               retry_after_s=found.retry_after_s)
        return found


def _invalid(field: str, rule: str) -> InvalidInput:
    return InvalidInput(f"{field}: {rule}", field=field, rule=rule)


def _text(what: str, file: File) -> bytes:
    try:
        return Path(file).read_bytes()
    except OSError as error:
        raise _invalid(what, f"{file} cannot be read: {error.strerror}") from error


def _certificates(what: str, file: File) -> bytes:
    """Returns the text of a file of certificates. Raises InvalidInput if it has none.

    gRPC would find a fault only at the first call, and say nothing of the file.
    """
    text = _text(what, file)
    try:
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_verify_locations(cadata=text.decode("ascii"))
    except (ssl.SSLError, ValueError):
        raise _invalid(what, f"{file} has no certificate in PEM form, or one that cannot be "
                       "read") from None
    return text


def _key(file: File, certificate: File) -> bytes:
    """Returns the text of the key of a certificate. Raises InvalidInput if it is not that."""
    text = _text("key", file)
    try:
        # Without the passphrase OpenSSL would ask the terminal for one.
        ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT).load_cert_chain(certificate, file, lambda: "")
    except ssl.SSLError as error:
        if error.reason in ("KEY_VALUES_MISMATCH", "KEY_TYPE_MISMATCH"):
            raise _invalid("key", f"{file} is not the key of {certificate}") from None
        raise _invalid("key", f"{file} has no private key in PEM form without a "
                       "passphrase") from None
    return text


def _is_ipv6(text: str) -> bool:
    """Whether a text is an IPv6 address without brackets, and possibly with a zone, %eth0."""
    try:
        ipaddress.IPv6Address(text.partition("%")[0])
    except ValueError:
        return False
    return True


def _is_loopback(server: str) -> bool:
    host = server.rpartition(":")[0].strip("[]")
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def open_channel(options: ConnectionOptions) -> grpc.Channel:
    """Returns a synchronous channel, which connects at the first call."""
    credentials, arguments = options.credentials(), options.channel_arguments()
    if credentials is None:
        return grpc.insecure_channel(options.server, options=arguments)
    return grpc.secure_channel(options.server, credentials, options=arguments)
