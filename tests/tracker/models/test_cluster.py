"""Work on a cluster: the same answers to the last bit, also when a process dies; and no cluster."""

import asyncio
import os
import signal
import subprocess
import sys
from urllib.error import HTTPError
from urllib.request import urlopen

import dask
import numpy as np
import pytest
from distributed import Security

from dynamics.frames import frame_batches
from dynamics.variational import Variational, variational_batches
from dynamics.viterbi import viterbi_all
from tests.oracles import random_slds
from tests.tracker.clips import refused, succeeds
from tests.tracker.gaits import both, sequence, write_poses
from tracker.models.by_motion import E_STEPS
from tracker.models.cluster import ClusterError, _uninterrupted, cluster_at, local_cluster, spread_over

pytestmark = pytest.mark.whole

NOBODY = 65534  # a user who owns nothing
LENGTHS = [*range(3, 12)] * 9  # sequences enough for several batches of every inference


@pytest.fixture
def problem(rng):
    """Two systems, as of two rounds of learning, and sequences."""
    sldss = [random_slds(K=6, rng=rng) for _ in range(2)]
    M = len(sldss[0].names)
    return sldss, [rng.normal(size=(T, M)) for T in LENGTHS]


def numbers(posterior):
    moments = [posterior.states, posterior.starts, posterior.steps]
    arrays = [array for each in moments if each is not None for array in (each.mean, each.cov)]
    return [posterior.prob, posterior.pair, posterior.lag, posterior.path, posterior.log_evidence, *arrays]


def check_same(ones, others):
    """Posteriors are the same to the last bit."""
    for one, other in zip(ones, others, strict=True):
        for wanted, found in zip(numbers(one), numbers(other), strict=True):
            assert np.array_equal(wanted, found)


@pytest.mark.parametrize("inference", E_STEPS)
def test_an_e_step_on_a_cluster_is_the_same_to_the_last_bit(cluster, problem, inference):
    make, cut = E_STEPS[inference]
    sldss, ys = problem
    assert len(cut(sldss[0], ys)) > 1
    here, there = make(), spread_over(cluster, make, cut)
    for slds in sldss:  # variational inference begins a round from the last one's answer
        check_same(here(slds, ys), there(slds, ys))


def test_a_process_that_dies_between_rounds_changes_nothing(cluster, problem):
    sldss, ys = problem
    here, there = Variational(), spread_over(cluster, Variational, variational_batches)
    here(sldss[0], ys), there(sldss[0], ys)
    pids = cluster.run(os.getpid)
    os.kill(next(iter(pids.values())), signal.SIGKILL)
    check_same(here(sldss[1], ys), there(sldss[1], ys))
    cluster.wait_for_workers(len(pids), timeout=60)


def test_a_process_that_dies_is_begun_anew_again_and_again_and_stays_deaf_to_interrupts():
    # A new process takes longer than this, so Dask looks for it too early.
    with dask.config.set({"distributed.deploy.lost-worker-timeout": "0.1s"}), local_cluster(1) as client:
        pids = [client.submit(os.getpid, pure=False).result(timeout=30)]
        for _ in range(2):
            os.kill(pids[-1], signal.SIGKILL)
            pids.append(client.submit(os.getpid, pure=False).result(timeout=30))
        assert len(set(pids)) == 3
        assert client.submit(signal.getsignal, signal.SIGINT).result(timeout=30) == signal.SIG_IGN


def test_what_an_e_step_finds_impossible_is_raised_here(cluster, problem):
    sldss, ys = problem
    there = spread_over(cluster, lambda: viterbi_all, frame_batches)
    with pytest.raises(np.linalg.LinAlgError):
        there(sldss[0], [np.full_like(ys[0], 1e200), *ys])


def test_learning_on_a_cluster_writes_the_same_model(cluster, tmp_path, rng):
    y, labels = both(rng, frames=40)
    tables = [
        write_poses(tmp_path / f"p{i}.csv", sequence(y, "a", labels=labels), further=["label"]) for i in "ab"
    ]
    (tmp_path / "quick.toml").write_text("rounds = 2\n")
    words = ["learn", *tables, "--states", 2, "--settings", tmp_path / "quick.toml", "--quiet"]
    address = cluster.scheduler.address
    for inference in ("viterbi", "variational"):
        here, there = tmp_path / f"{inference}1.npz", tmp_path / f"{inference}2.npz"
        succeeds(*words, "--inference", inference, "--out", here)
        succeeds(*words, "--inference", inference, "--scheduler", address, "--out", there)
        with np.load(here) as one, np.load(there) as other:
            assert all(np.array_equal(one[name], other[name]) for name in one.files)
    said = refused(*words[:-1], "--inference", "hmm", "--scheduler", address, "--out", tmp_path / "h.npz")
    assert "leave out --scheduler" in said


def reached(address, security, patience=0.5):
    """Whether somebody is let in who has these keys, within some seconds."""
    from distributed.comm import connect

    async def knock():
        comm = await connect(address, timeout=patience, **security.get_connection_args("client"))
        try:
            await comm.write({"op": "identity"})
            return bool(await comm.read())
        finally:
            await comm.close()

    try:
        return asyncio.run(knock())
    except (OSError, TypeError, RuntimeError):
        return False


def doors_of(client):
    """The addresses of the scheduler, of a worker and of the process that watches it."""
    workers = client.scheduler_info()["workers"]
    doors = [client.cluster.scheduler_address, *workers, *(each["nanny"] for each in workers.values())]
    assert len(doors) == 3
    return doors


def test_nobody_else_on_this_machine_gets_in_to_its_processes():
    # A user without a key, and one with another batch's: other pairs fail before they are at the door.
    others = [("tcp", Security()), ("tls", Security.temporary())]
    with local_cluster(1) as client:
        for door in doors_of(client):
            bare = door.partition("://")[2]
            assert reached(door, client.security, patience=10.0)
            assert not any(reached(f"{way}://{bare}", who) for way, who in others)
        pages = client.cluster.dashboard_link.removesuffix("status")
        with pytest.raises(HTTPError, match="404"):
            urlopen(f"{pages}info/main/workers.html")


# What another user can try with Python alone: to be let in, and to read the keys of a process.
INTRUDER = """
import os, socket, ssl, sys
"loaded before that is forbidden".encode("idna")
os.setgroups([])
os.setuid(int(sys.argv[3]))
way = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
way.check_hostname, way.verify_mode = False, ssl.CERT_NONE
for door in sys.argv[1].split(","):
    host, port = door.split(":")
    for secured in (False, True):
        try:
            with socket.create_connection((host, int(port)), timeout=float(sys.argv[4])) as bare:
                with way.wrap_socket(bare) if secured else bare as line:
                    print("let in" if line.recv(1) else "shut out")
        except OSError:
            print("shut out")
for pid in sys.argv[2].split(","):
    for secret in ("environ", "mem"):
        try:
            open(f"/proc/{pid}/{secret}", "rb").close()
            print("read", secret)
        except OSError:
            print("shut out")
"""


@pytest.mark.skipif(not hasattr(os, "getuid") or os.getuid() != 0, reason="only root can become another user")
@pytest.mark.parametrize("secured", [True, False], ids=["with TLS", "were it without"])
def test_another_user_of_this_machine_neither_gets_in_nor_reads_a_key(secured, monkeypatch):
    if not secured:
        monkeypatch.setattr(Security, "temporary", Security)
    with local_cluster(1) as client:
        bare = ",".join(door.partition("://")[2] for door in doors_of(client))
        pids = ",".join(map(str, [os.getpid(), *client.run(os.getpid).values()]))
        patience = "0.5" if secured else "5"
        words = [sys.executable, "-I", "-c", INTRUDER, bare, pids, str(NOBODY), patience]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout.splitlines()
    assert said == ["shut out" if secured else "let in", "shut out"] * 3 + ["shut out"] * 4


def test_a_cluster_with_a_certificate_is_asked_with_it(tmp_path, rng):
    ours = Security.temporary()
    pem = tmp_path / "cluster.pem"
    pem.write_text(ours.tls_client_cert + ours.tls_client_key)
    keys = [f"distributed.comm.tls.{part}" for part in ("ca-file", "client.cert", "client.key")]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Security, "temporary", lambda: ours)
        with local_cluster(1) as client:
            address = client.cluster.scheduler_address
            with dask.config.set(dict.fromkeys(keys, str(pem))), cluster_at(address) as there:
                assert there.submit(sum, [1, 2]).result(timeout=30) == 3
            patch.setattr("tracker.models.cluster.PATIENCE", 0.5)
            bare = address.replace("tls", "tcp")
            for wrong in (address, bare):
                with pytest.raises(ClusterError, match="wants a certificate"), cluster_at(wrong):
                    pass


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "ftp://127.0.0.1:9"])
def test_no_scheduler_is_said(address, monkeypatch):
    monkeypatch.setattr("tracker.models.cluster.PATIENCE", 0.5)
    with pytest.raises(ClusterError, match="no Dask scheduler answers at"), cluster_at(address):
        pass


def test_ctrl_c_waits_until_a_cluster_is_begun_or_ended():
    done = []

    def interrupted():
        with _uninterrupted():
            signal.raise_signal(signal.SIGINT)
            signal.raise_signal(signal.SIGINT)
            done.append("all")

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert done
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
