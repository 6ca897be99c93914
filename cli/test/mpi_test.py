"""`campaign` in processes of its own (--serve), and as a job of mpirun. Run by CTest with TRIHEDRON_BUILD naming the build directory."""
import errno
import os
import pathlib
import re
import shutil
import signal
import subprocess
import time

import pytest

from campaign_test import CAMPAIGN, FILTERS, flown, long_one, lose, records, table, until
from outputs_test import faults
from program import BUILD, INPUT_REFUSED, MACHINE_FAILED, PROGRAM, ROOT, TRUSTWORTHY, WRONG_USAGE, refused, run

MPIRUN = shutil.which("mpirun")
needs_mpi = pytest.mark.skipif(not (MPIRUN and (BUILD / "trihedron-mpi.so").exists()),
                               reason="no MPI: cmake/setup.sh mpi installs it, and then the program is built with it")


@pytest.fixture(scope="module")
def alone(tmp_path_factory):
    return flown(tmp_path_factory.mktemp("mpi"), CAMPAIGN)


def mpirun(ranks, *arguments):
    """As any user, on however many processors: options that tests need and users do not."""
    return [MPIRUN, "--allow-run-as-root", "--oversubscribe", "-n", str(ranks), PROGRAM, *map(str, arguments)]


def started(command, **options):
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True, **options)


def state_of(pid):
    return re.search(r"\nState:\t(.)", pathlib.Path(f"/proc/{pid}/status").read_text())[1]


def processes_of_session(group):
    """Those that have not ended."""
    found = []
    for pid in (int(process.name) for process in pathlib.Path("/proc").iterdir() if process.name.isdigit()):
        try:
            if os.getsid(pid) == group and state_of(pid) not in "ZX":
                found.append(pid)
        except OSError:
            pass
    return found


def workers_of(group):
    """Processes that perform runs, of this session."""
    found = []
    for pid in processes_of_session(group):
        try:
            if b"--serve" in pathlib.Path(f"/proc/{pid}/cmdline").read_bytes().split(b"\0"):
                found.append(pid)
        except OSError:
            pass
    return found


def written_by(pid):
    return int(re.search(r"wchar: (\d+)", pathlib.Path(f"/proc/{pid}/io").read_text())[1])


def until_ended(group):
    for _ in range(2000):
        if not processes_of_session(group):
            return
        time.sleep(0.01)
    pytest.fail("not all processes have ended")


def is_caught_while_it_starts(worker):
    """Stopped, and has not said its first line; false as well where it has ended."""
    os.kill(worker, signal.SIGSTOP)
    while state_of(worker) not in "TZX":
        time.sleep(0.0005)
    return state_of(worker) == "T" and written_by(worker) == 0


# Without MPI.

def test_serve_performs_the_runs_that_it_is_given(alone):
    directory, _ = alone
    result = run("campaign", directory / "c.toml", "--serve", input="7\n2 11 4\n")
    assert result.returncode == TRUSTWORTHY and not result.stderr
    digest, *lines = result.stdout.splitlines()
    assert len(digest) == 16 and len(lines) == 4
    journal = (directory / "out" / "runs.journal").read_text().splitlines()
    assert digest in journal[0]
    for line in lines:
        assert any(untimed(line) == untimed(other) for other in journal[1:]), line


def untimed(line):
    return line[9:].split('"cpu_s"')[0]


@pytest.mark.parametrize("given", ["12\n", "-1\n", "1 12\n", "x\n", "1 x\n", "\n"])
def test_serve_refuses_what_is_no_run(alone, given):
    result = run("campaign", alone[0] / "c.toml", "--serve", input=given)
    assert result.returncode == WRONG_USAGE
    assert "0 to 11" in result.stderr and result.stdout.count("\n") == 1


def test_serve_goes_with_no_output(alone):
    refused(run("campaign", alone[0] / "c.toml", "--serve", "-o", "out"), WRONG_USAGE, "--serve")


def test_a_job_without_the_library_is_refused_with_the_cure(alone, tmp_path):
    shutil.copy(PROGRAM, tmp_path / "trihedron")
    command = [tmp_path / "trihedron", "campaign", alone[0] / "c.toml", "-o", tmp_path / "out"]
    environment = {**os.environ, "PMIX_RANK": "0"}
    result = subprocess.run(command, env=environment, capture_output=True, text=True)
    refused(result, MACHINE_FAILED, "trihedron-mpi.so", "install trihedron-mpi", "libopenmpi-dev")
    another = re.search(r"libz\S* => (\S+)", subprocess.run(["ldd", PROGRAM], check=True, capture_output=True, text=True).stdout)[1]
    shutil.copy(another, tmp_path / "trihedron-mpi.so")
    result = subprocess.run(command, env=environment, capture_output=True, text=True)
    refused(result, MACHINE_FAILED, "another version", "install trihedron-mpi")
    assert not (tmp_path / "out").exists()


def without_proc(library, calls):
    return {**os.environ, "LD_PRELOAD": str(library), "FAULTS_BELOW": "/proc/self/exe", "FAULTS_CALLS": calls, "FAULTS_FIRST": "1",
            "FAULTS_LAST": "1000", "FAULTS_DO": f"errno {errno.ENOENT}"}


def test_without_proc_a_job_says_why_the_library_is_not_found(alone, faults, tmp_path):
    result = run("campaign", alone[0] / "c.toml", "-o", tmp_path / "out", env={**without_proc(faults, "link"), "PMIX_RANK": "0"})
    refused(result, MACHINE_FAILED, "/proc/self/exe", "No such file", "trihedron-mpi.so", "mount /proc")


def test_a_run_alone_is_no_job(alone):
    refused(run("campaign", alone[0] / "c.toml", "--only", "1", env={**os.environ, "PMIX_RANK": "0"}), WRONG_USAGE, "--only", "without mpirun")


# With MPI.

@needs_mpi
@pytest.mark.long
@pytest.mark.parametrize("ranks, jobs", [(1, "1"), (3, "2")])
def test_a_job_gives_the_table_of_one_process(alone, tmp_path, ranks, jobs):
    directory, status = alone
    # mpirun gives the program a terminal of its own.
    environment = {**{name: value for name, value in os.environ.items() if name != "NO_COLOR"}, "TERM": "xterm"}
    result = subprocess.run(mpirun(ranks, "campaign", directory / "c.toml", "-o", tmp_path / "out", "--jobs", jobs), capture_output=True, text=True,
                            env=environment)
    assert result.returncode == status, result.stderr
    assert "\x1b" not in result.stdout + result.stderr
    assert result.stdout.count("Test: 12 runs") == 1
    assert table(tmp_path / "out") == table(directory / "out")
    assert sorted(os.listdir(tmp_path / "out")) == ["report.html", "runs.journal", "runs.nc", "times.csv"]


@needs_mpi
def test_runs_that_were_lost_are_performed_again(alone, tmp_path):
    directory, status = alone
    shutil.copytree(directory / "out", tmp_path / "out")
    lose(tmp_path / "out" / "runs.journal", 7)
    resume = mpirun(1, "--quiet", "campaign", directory / "c.toml", "-o", tmp_path / "out", "--resume")
    result = subprocess.run(resume, capture_output=True, text=True)
    assert result.returncode == status, result.stderr
    assert "1 run was lost with its process, performed again" in result.stderr
    assert table(tmp_path / "out") == table(directory / "out")
    assert "lost" not in subprocess.run(resume, capture_output=True, text=True).stderr


@needs_mpi
@pytest.mark.long
def test_a_job_gives_the_table_of_one_process_where_runs_go_side_by_side(tmp_path):
    directory, status = flown(tmp_path, FILTERS)
    result = subprocess.run(mpirun(2, "--quiet", "campaign", directory / "c.toml", "-o", tmp_path / "job", "--jobs", "1"), capture_output=True, text=True)
    assert result.returncode == status, result.stderr
    assert table(tmp_path / "job") == table(directory / "out")


@needs_mpi
@pytest.mark.long
def test_a_worker_that_is_killed_loses_its_run_only_and_the_campaign_goes_on(long_one, tmp_path):
    directory, status = long_one
    out = tmp_path / "out"
    process = started(mpirun(2, "campaign", directory / "c.toml", "-o", out))
    until(out / "runs.journal", 1, process)
    # One alone: a run that another gets, which is killed as well, is a row without a result.
    os.kill(workers_of(process.pid)[0], signal.SIGKILL)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == status, stderr
    assert table(out) == table(directory / "out")
    assert records(out) == 120


@needs_mpi
@pytest.mark.long
@pytest.mark.parametrize("most", [2, 1000])
def test_a_worker_that_is_killed_while_it_starts_is_followed_by_another_but_not_for_ever(long_one, tmp_path, most):
    directory, status = long_one
    # The test has the processor before the workers, so that it is not late.
    process = started(["nice", "-n", "19", *mpirun(1, "campaign", directory / "c.toml", "-o", tmp_path / "out", "--jobs", "1")])
    seen, killed = set(), 0
    while process.poll() is None and killed < most:
        for worker in set(workers_of(process.pid)) - seen:
            seen.add(worker)
            # On a busy machine it may have begun its run. The first may, the second not: a run that is lost twice is a row without a result.
            kill = is_caught_while_it_starts(worker) or most > 2 or killed == 0
            os.kill(worker, signal.SIGKILL if kill else signal.SIGCONT)
            killed += kill
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == (status if most == 2 else MACHINE_FAILED), stderr
    assert killed
    assert most == 2 or "cannot be started to perform runs: signal 9" in stderr


@needs_mpi
@pytest.mark.long
def test_a_kill_of_all_ranks_loses_no_finished_run_and_repeats_none(long_one, tmp_path):
    directory, status = long_one
    out = tmp_path / "out"
    process = started(mpirun(3, "campaign", directory / "c.toml", "-o", out))
    until(out / "runs.journal", 3, process)
    # mpirun gives each rank a process group of its own: the session has them all.
    subprocess.run(["pkill", "--signal", "KILL", "--session", str(process.pid)], check=True)
    process.communicate(timeout=60)
    until_ended(process.pid)
    kept = (out / "runs.journal").read_text()
    kept = kept[: kept.rindex("\n") + 1]
    assert not (out / "runs.nc").exists()
    result = subprocess.run(mpirun(2, "campaign", directory / "c.toml", "-o", out, "--resume"), capture_output=True, text=True)
    assert result.returncode == status, result.stderr
    assert (out / "runs.journal").read_text().startswith(kept)
    assert records(out) == 120
    assert table(out) == table(directory / "out")


@needs_mpi
@pytest.mark.long
@pytest.mark.parametrize("other, words", [("other.toml", "rank 1 reads another campaign than rank 0"), ("nowhere.toml", "nowhere.toml")])
def test_a_rank_with_other_files_ends_the_job(tmp_path, other, words):
    long = CAMPAIGN.replace("repeats = 2", "repeats = 2000")  # the end of the job is long before that of the runs
    (tmp_path / "c.toml").write_text(long)
    (tmp_path / "other.toml").write_text(long.replace("seed = 5", "seed = 6"))
    command = mpirun(1, "campaign", tmp_path / "c.toml", "-o", tmp_path / "out")
    command += [":", *mpirun(1, "campaign", tmp_path / other, "-o", tmp_path / "out")[3:]]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert result.returncode == MACHINE_FAILED, result.stderr
    assert words in result.stderr
    assert not (tmp_path / "out" / "runs.nc").exists()


@needs_mpi
@pytest.mark.long
def test_without_proc_a_job_says_why_no_run_can_be_performed(alone, faults, tmp_path):
    result = subprocess.run(mpirun(1, "campaign", alone[0] / "c.toml", "-o", tmp_path / "out"), env=without_proc(faults, "spawn"),
                            capture_output=True, text=True, timeout=60)
    assert result.returncode == MACHINE_FAILED
    assert "/proc/self/exe: cannot be started to perform runs: No such file" in result.stderr and "mount /proc" in result.stderr


@needs_mpi
@pytest.mark.long
def test_the_batch_file_begins_and_goes_on(alone, tmp_path):
    """As Slurm runs it, but for its ranks, which are those of this machine."""
    directory, status = alone
    environment = {**os.environ, "PATH": f"{BUILD}:{os.environ['PATH']}", "OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
    for _ in range(2):
        result = subprocess.run(["bash", ROOT / "examples" / "campaign.sbatch", directory / "c.toml", tmp_path / "out"], env=environment,
                                capture_output=True, text=True)
        assert result.returncode == status, result.stderr
    assert table(tmp_path / "out") == table(directory / "out")
    assert records(tmp_path / "out") == 12


@needs_mpi
@pytest.mark.long
def test_what_is_refused_is_refused_once_and_nothing_is_left_behind(alone, tmp_path):
    directory, _ = alone
    (tmp_path / "c.toml").write_text(CAMPAIGN.replace("seed = 5", "sed = 5"))
    process = started(mpirun(3, "campaign", tmp_path / "c.toml", "-o", tmp_path / "out"))
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == INPUT_REFUSED
    assert stderr.count('did you mean "seed"') == 1
    assert not (tmp_path / "out").exists()
    process = started(mpirun(2, "campaign", directory / "c.toml", "-o", directory / "out"))
    _, stderr = process.communicate(timeout=60)
    assert process.returncode == INPUT_REFUSED and stderr.count("--resume") == 1
    assert not workers_of(process.pid)


def processes_of(group, rank):
    """Of the session: the rank itself and its worker, which has the same environment; None where it is not there yet."""
    its, worker = None, None
    for pid in processes_of_session(group):
        try:
            of_rank = f"PMIX_RANK={rank}".encode() in pathlib.Path(f"/proc/{pid}/environ").read_bytes().split(b"\0")
        except OSError:
            continue
        if of_rank and pid in workers_of(group):
            worker = pid
        elif of_rank:
            its = pid
    return its, worker


@needs_mpi
@pytest.mark.long
def test_a_rank_that_is_killed_loses_its_run_only_where_mpirun_lets_the_job_go_on(long_one, tmp_path):
    """With --continuous; without it mpirun ends the whole job, and --resume carries on."""
    directory, _ = long_one
    command = mpirun(3, "campaign", directory / "c.toml", "-o", tmp_path / "out")
    process = started([command[0], "--continuous", *command[1:]])
    worker = None
    while worker is None or written_by(worker) < 1000:  # it has told of a run, and is given the next
        lost, worker = processes_of(process.pid, 2)
    os.kill(lost, signal.SIGSTOP)  # all others are performed meanwhile
    until(tmp_path / "out" / "runs.journal", 119, process)
    os.kill(lost, signal.SIGKILL)
    _, stderr = process.communicate(timeout=120)
    assert process.returncode == 0, stderr  # mpirun's own: with --continuous it does not give that of rank 0
    assert "rank 2 says nothing any more" in stderr
    assert table(tmp_path / "out") == table(directory / "out")
    assert records(tmp_path / "out") == 120
    assert not workers_of(process.pid)
