"""Work distributed over processes by Dask, on this machine or on a cluster with a scheduler's address.

Messages are pickled, so anybody who can reach a scheduler can run any code on it. All users of a machine
share its loopback address, so the cluster of this machine uses TLS with a new key each time, and admits only
processes that have the key.
"""

import asyncio
import copy
import logging
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from operator import itemgetter
from typing import TYPE_CHECKING, Any

from dynamics.chain import in_order
from dynamics.gaussian import Array
from dynamics.posterior import Infer, Posterior
from dynamics.slds import SLDS
from tracker.models.by_motion import Batches

if TYPE_CHECKING:
    from distributed import Client, Security

# By default Dask returns memory to the system after every array, which makes an E-step twice as slow.
TRIM = "distributed.nanny.pre-spawn-environ.MALLOC_TRIM_THRESHOLD_"
# Dask restarts a process that dies. After a while it checks for it; a process that is absent at that moment,
# slow on a busy machine or dead again, is abandoned, and without the last one the work waits for ever.
GIVE_UP = "distributed.deploy.lost-worker-timeout"
NEVER = "1000 days"
STALL = "distributed.scheduler.no-workers-timeout"
STALLED = "10 minutes"  # time without any process after which the work fails
# Pages that every user of this machine could read by HTTP, with TLS or without.
PAGES = ("distributed.scheduler.http.routes", "distributed.worker.http.routes")
PATIENCE = 5  # seconds for a scheduler to answer
ENDING = (signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", signal.SIGTERM))  # Windows has none

Turn = tuple[list[Posterior], Infer]


class ClusterError(ValueError):
    """A scheduler that cannot be reached, or that has no workers."""


@contextmanager
def local_cluster(workers: int) -> Iterator["Client"]:
    """Processes on this machine, `workers` of them with one thread each; they end with the block."""
    import dask
    from distributed import Client, LocalCluster, Security

    stack = ExitStack()
    try:
        with _uninterrupted():
            stack.enter_context(
                dask.config.set({TRIM: None, GIVE_UP: NEVER, STALL: STALLED} | {page: [] for page in PAGES})
            )
            # A worker that dies is replaced and its work repeated, so Dask's log of it is of no use.
            cluster = LocalCluster(
                n_workers=workers,
                threads_per_worker=1,
                memory_limit=None,
                dashboard_address="127.0.0.1:0",
                security=Security.temporary(),
                silence_logs=logging.CRITICAL,
            )
            client = stack.enter_context(Client(stack.enter_context(cluster)))
            client.register_worker_callbacks(_ignore_interrupts)
        yield client
    finally:
        with _uninterrupted():
            stack.close()


@contextmanager
def cluster_at(address: str) -> Iterator["Client"]:
    """The cluster of a Dask scheduler, asked with the certificate that Dask's configuration names, if any.

    ClusterError: no scheduler there, or one without workers.
    """
    from distributed import Client, Security

    security = Security()
    try:
        # Tested beforehand: a Client that was refused may block a later one when it is garbage collected.
        asyncio.run(_reach(address, security))
        client = Client(address, timeout=PATIENCE, security=security)
    except (OSError, ValueError, TypeError, RuntimeError) as error:  # the last two: one side without TLS
        raise ClusterError(
            f"no Dask scheduler answers at {address}; start one with 'dask scheduler'; docs/batch.md tells "
            "how to ask one that wants a certificate, at an address that begins with tls://"
        ) from error
    with client:
        if not client.scheduler_info()["workers"]:
            raise ClusterError(f"the scheduler at {address} has no workers; add some: dask worker {address}")
        yield client


def spread_over(client: "Client", make: Callable[[], Infer], batches: Batches) -> Infer:
    """The E-step of `make` with its batches distributed over a cluster, where each keeps its state.

    The batches are those of the E-step in one process, so its result is the same to the last bit if the
    machines round alike.
    """
    turns: list[Any] = []  # Turns, or futures of them

    def infer(slds: SLDS, ys: Sequence[Array]) -> list[Posterior]:
        chosen = batches(slds, ys)
        if len(turns) != len(chosen):
            turns[:] = [([], make()) for _ in chosen]
        turns[:] = [
            client.submit(_turn, turn, slds, [ys[n] for n in batch], pure=False)
            for turn, batch in zip(turns, chosen, strict=True)
        ]
        found = client.gather(client.map(itemgetter(0), turns, pure=False))
        return in_order(chosen, found)

    return infer


def _ignore_interrupts() -> None:
    """Ignore Ctrl-C, which reaches every process of a terminal; only the main process handles it."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """Delay Ctrl-C until after this block, since Dask cannot be interrupted while it starts or stops."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    handlers = {number: signal.getsignal(number) for number in ENDING}
    usual = {number: handler for number, handler in handlers.items() if callable(handler)}
    for number in usual:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in usual.items():
            signal.signal(number, handler)
    if came:
        signal.raise_signal(came[0])


def _turn(before: Turn, slds: SLDS, ys: Sequence[Array]) -> Turn:
    # A copy: if a worker dies, its turns are repeated from their original state.
    step = copy.copy(before[1])
    return step(slds, ys), step


async def _reach(address: str, security: "Security") -> None:
    from distributed.comm import connect

    comm = await connect(address, timeout=PATIENCE, **security.get_connection_args("client"))
    await comm.close()
