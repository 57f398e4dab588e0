"""Connections with TLS: the daemon's certificate, the client's own, tokens."""

import subprocess

import pytest

import polyest
from polyest import _daemon


def openssl(folder, *arguments):
    subprocess.run(["openssl", *arguments], cwd=folder, check=True, capture_output=True)


@pytest.fixture(scope="module")
def certificates(tmp_path_factory):
    """A folder with two CAs, and certificates of the first for a daemon and for a client."""
    folder = tmp_path_factory.mktemp("tls")
    key = ("-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes")
    for name in ("ca", "other"):
        openssl(folder, "req", "-x509", *key, "-keyout", f"{name}.key", "-out", f"{name}.pem",
                "-subj", f"/CN={name}", "-days", "2")
    (folder / "names").write_text("subjectAltName=DNS:rig.example.org,IP:127.0.0.1\n")
    for name in ("daemon", "client"):
        openssl(folder, "req", *key, "-keyout", f"{name}.key", "-out", f"{name}.csr", "-subj",
                f"/CN={name}")
        openssl(folder, "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key",
                "-CAcreateserial", "-out", f"{name}.pem", "-days", "2", "-extfile", "names")
    return folder


@pytest.fixture(scope="module")
def secured(certificates):
    """A daemon that asks for the certificates of clients, and for tokens."""
    made = subprocess.run([_daemon.find_program(None), "--new-token", "rig:lab:writer"],
                          capture_output=True, text=True, check=True)
    (certificates / "tokens").write_text(made.stderr)
    (certificates / "rig.token").write_text(made.stdout)
    daemon = _daemon.start(arguments=[
        "--tls-certificate", str(certificates / "daemon.pem"),
        "--tls-key", str(certificates / "daemon.key"),
        "--tls-client-ca", str(certificates / "ca.pem"),
        "--tokens", str(certificates / "tokens")])
    yield daemon.address
    daemon.stop()


def options(certificates, **changes):
    return {"ca": certificates / "ca.pem", "certificate": certificates / "client.pem",
            "key": certificates / "client.key", "token_file": certificates / "rig.token", **changes}


def test_a_session_is_written_over_tls(secured, certificates, problem, rows):
    with polyest.connect(secured, **options(certificates)) as client:
        with client.session("secured", problem) as session:
            session.append(rows(0, 100))
            assert session.estimate().samples == 100


def test_the_name_in_the_certificate_may_be_given(secured, certificates):
    with polyest.connect(secured, **options(certificates, server_name="rig.example.org")) as client:
        assert client.sessions() is not None
    other = options(certificates, server_name="other.example.org")
    with polyest.connect(secured, **other) as wrong:
        with pytest.raises(polyest.Unavailable):
            wrong.status()


@pytest.mark.parametrize("changes", [
    {"ca": "other.pem"}, {"certificate": None, "key": None},
], ids=["another CA", "no certificate"])
def test_a_connection_that_is_not_trusted_is_refused(secured, certificates, changes):
    changes = {name: file and certificates / file for name, file in changes.items()}
    with polyest.connect(secured, **options(certificates, **changes)) as client:
        with pytest.raises(polyest.Unavailable):
            client.status()


def test_a_token_that_is_replaced_takes_effect(secured, certificates, tmp_path):
    token = tmp_path / "token"
    token.write_text("wrong")
    with polyest.connect(secured, **options(certificates, token_file=token)) as client:
        with pytest.raises(polyest.Unauthenticated):
            client.status()
        token.write_text((certificates / "rig.token").read_text())
        assert client.status().version


@pytest.mark.parametrize(("changes", "said"), [
    ({"ca": "ca.key"}, "ca: .*ca.key has no certificate in PEM form"),
    ({"ca": "broken"}, "ca: .*broken has no certificate in PEM form, or one that cannot be read"),
    ({"certificate": "client.key"}, "certificate: .*client.key has no certificate"),
    ({"key": "client.pem"}, "key: .*client.pem has no private key in PEM form"),
    ({"key": "daemon.key"}, "key: .*daemon.key is not the key of .*client.pem"),
])
def test_a_file_that_cannot_be_used_is_named_before_connecting(certificates, changes, said):
    text = (certificates / "ca.pem").read_text()
    (certificates / "broken").write_text(text[:100] + "\n-----END CERTIFICATE-----\n")
    changes = {name: certificates / file for name, file in changes.items()}
    with pytest.raises(polyest.InvalidInput, match=said):
        polyest.connect("127.0.0.1:1", **options(certificates, token_file=None, **changes))
