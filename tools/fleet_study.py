"""Studies of simulated specimens for tools/fleet_trial and tools/slurm_cluster."""
import json
import subprocess


def search_command(arguments, *options, first=1, last=None):
    return [arguments.torsio, "search", "--specimens", f"dfki-50#{first:04}..#{last or arguments.specimens:04}",
            "--models", arguments.model, "--duration", arguments.duration, *options]


def run_alone(arguments, *options):
    """The results of one process: for each device the state, the RMSE and the reason.

    The RMSE is the text of the number, the shortest that reads as the same double.
    """
    done = subprocess.run(search_command(arguments, "--json", "-", *options), stdin=subprocess.DEVNULL, capture_output=True,
                          text=True, check=False)
    if done.returncode != 0:
        raise RuntimeError(f"torsio search ended with {done.returncode}: {done.stderr.strip()[-500:]}")
    return {row["device"]: (row["state"], row["rmse"], row["reason"])
            for row in json.loads(done.stdout, parse_float=str)["specimens"]}


def best_of(results):
    return min(((float(rmse), device) for device, (_, rmse, _) in results.items() if rmse is not None), default=(0.0, "none"))[1]
