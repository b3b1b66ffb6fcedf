# One rule for each stage of the plan: `rockframe step FOLDER NAME`. Exit status 1 means that
# records were rejected and listed; it is a failure of `verify` only. The shell command has no
# variable of the loop below: Snakemake evaluates it when the job runs, after the loop.


def outputs_of(steps):
    """Return the outputs of a stage, with a wildcard for the number of the batch."""
    first = steps[0]
    if not first["outputs"]:
        return [touch(f".rockframe/ended/{first['name']}")]
    if first["batch"][1] == 1:
        return [directory(n.rstrip("/")) if n.endswith("/") else n for n in first["outputs"]]
    (name,) = first["outputs"]
    return [name.replace("-001.nc", r"-{batch,\d+}.nc")]


def step_of(rule_name, wildcards):
    """Return the step of the plan that a job performs."""
    number = int(getattr(wildcards, "batch", 1))
    return STEPS[rule_name][number - 1]


def name_of(rule_name):
    return lambda wildcards: step_of(rule_name, wildcards)["name"]


def key_of(rule_name):
    """Return the key of a step, with the package's source: if it changes, the job runs again."""
    return lambda wildcards: PLAN["keys"][step_of(rule_name, wildcards)["name"]]


for rule_name, steps in STEPS.items():
    batch = "-{batch}" if steps[0]["batch"][1] > 1 else ""

    rule:
        name:
            rule_name
        input:
            steps[0]["inputs"],
        output:
            outputs_of(steps),
        log:
            f"logs/snakemake/{rule_name}{batch}.log",
        benchmark:
            f".rockframe/benchmarks/{rule_name}{batch}.tsv"
        params:
            step=name_of(rule_name),
            key=key_of(rule_name),
            accepted=int(steps[0]["may_reject"]),
            source=PLAN["source_code_hash"],
        threads: steps[0]["threads"]
        resources:
            mem_mb=steps[0]["memory"],
            runtime=steps[0]["minutes"],
        retries: 2
        shell:
            "( rockframe step . {params.step} --workers {threads}"
            " || [ $? -eq {params.accepted} ] ) > {log} 2>&1"
