"""Who may talk to the server."""

import pytest

from corporeal.viewer.access import AccessPolicy, host_name
from corporeal.viewer.run_store import RunStore
from corporeal.viewer.server import ListenAddress, access_policy_of, address_words, is_local
from corporeal.viewer.web_app import SiteOptions, make_app
from viewer_server import LOCAL, serving

TOKEN = "a-token-that-nobody-guesses"


@pytest.fixture(scope="module")
def server(small_run):
    with serving(make_app(SiteOptions(RunStore((), small_run.parent)), LOCAL)) as made:
        yield made


@pytest.mark.parametrize("name", ["evil.example", "evil.example:80", "127.0.0.1.evil.example", "["])
def test_a_foreign_host_is_refused(server, name):
    assert server.ask("/", Host=name).status == 400
    assert server.ask("/", Host="10.1.2.3").status == 400  # none is needed: this is local


@pytest.mark.parametrize("name", ["127.0.0.1", "localhost:8321", "[::1]:8321"])
def test_this_machines_own_names_are_taken(server, name):
    assert server.ask("/", Host=name).status == 200


def test_a_page_of_another_origin_reads_and_changes_nothing(server):
    assert server.ask("/runs", Origin="http://evil.example").status == 403
    assert server.ask("/runs", Origin="null").status == 403
    own = f"http://127.0.0.1:{server.port}"
    assert server.ask("/runs", Origin=own).status == 200
    assert server.ask("/runs", Origin=f"http://127.0.0.1:{server.port + 1}").status == 403


def test_a_change_needs_a_header_that_foreign_pages_cannot_send(server):
    assert server.ask("/runs", "POST", b"{}").status == 403
    assert server.ask("/runs", "POST", b"{}", X_Corporeal="1").status == 405


def test_pages_may_load_nothing_from_elsewhere(server):
    for path in ("/", "/runs", "/web/page.js"):
        answer = server.ask(path)
        policy = answer.headers["content-security-policy"]
        assert policy.startswith("default-src 'none'; script-src 'self'; style-src 'self'")
        assert "unsafe" not in policy
        assert answer.headers["x-content-type-options"] == "nosniff"


@pytest.mark.parametrize(
    "path", ["/web/../guard.py", "/web/%2e%2e/guard.py", "/web/three.names.js", "/take/..",
             "/take/%2e%2e", "/report/..%2f..%2fetc", "/view/a/b/c", "/view/%00", "/picture/nobody"]
)  # fmt: skip
def test_nothing_but_runs_and_the_pages_own_files_is_given(server, path):
    assert server.ask(path).status == 404


def test_the_page_is_given_what_there_is_to_play(server, small_run):
    assert server.ask("/view/drop").status == 200
    listed = server.ask("/runs").json["runs"]
    assert [(r["name"], r["shown"]) for r in listed] == [("drop", True)]
    block = server.ask("/take/drop")
    assert block.status == 200 and b'"name": "drop"' in block.body[:4000]


def test_a_token_is_asked_for_and_kept_in_a_cookie(small_run):
    with serving(make_app(SiteOptions(RunStore((), small_run.parent)), AccessPolicy(token=TOKEN))) as server:
        assert server.ask("/runs").status == 401
        assert server.ask("/runs?token=wrong").status == 401
        assert server.ask("/runs", Cookie="corporeal=wrong").status == 401
        first = server.ask(f"/view/drop?token={TOKEN}")
        assert first.status == 303 and first.headers["location"] == "/view/drop"
        cookie = first.headers["set-cookie"]
        assert "HttpOnly" in cookie and "samesite=strict" in cookie.lower()
        assert server.ask("/runs", Cookie=cookie.split(";")[0]).status == 200
        assert server.ask("/runs", Host="10.1.2.3", Cookie=f"corporeal={TOKEN}").status == 200
        assert server.ask("/runs", Host="evil.example").status == 400
        away = server.ask(f"//evil.example?token={TOKEN}")
        assert away.headers["location"] == "/evil.example"


def test_only_another_machines_address_demands_a_token():
    for host in ("127.0.0.1", "localhost", "::1", "127.8.0.1"):
        assert is_local(host) and access_policy_of(ListenAddress(host)).token == ""
    tokens = {access_policy_of(ListenAddress("0.0.0.0")).token for _ in range(3)}
    assert len(tokens) == 3 and min(map(len, tokens)) >= 24
    assert not is_local("example.org")


def test_the_address_says_how_to_come_in():
    assert address_words(ListenAddress(), 8321, AccessPolicy())[0] == "http://127.0.0.1:8321/"
    assert "ssh -L 8321:127.0.0.1:8321" in address_words(ListenAddress(), 8321, AccessPolicy())[1]
    assert f"?token={TOKEN}" in address_words(ListenAddress("10.1.2.3"), 80, AccessPolicy(token=TOKEN))[0]


def test_a_hosts_name_is_read_without_its_port():
    assert [host_name(h) for h in ("a:1", "[::1]:2", "A.b", "x]", "")] == ["a", "::1", "a.b", "", ""]
