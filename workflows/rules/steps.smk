# One rule for each stage of the plan: `rockframe step FOLDER NAME`. Exit status 1 means that records
# were rejected, and listed, and is no failure but for `verify`.


def outputs_of(steps):
    """The outputs of a stage: of batches those of any of them, by a wildcard."""
    first = steps[0]
    if not first["outputs"]:
        return [touch(f".rockframe/ended/{first['name']}")]
    if not first["temporary"]:
        return [directory(n.rstrip("/")) if n.endswith("/") else n for n in first["outputs"]]
    (name,) = first["outputs"]
    return [temp(name.replace("-001.nc", r"-{batch,\d+}.nc"))]


def step_of(rule_name, wildcards):
    """The step of the plan that a job is."""
    number = int(getattr(wildcards, "batch", 1))
    return STEPS[rule_name][number - 1]


def called(step):
    """How a step is called: with its processes, and with what is no failure."""
    words = "rockframe step . {params.step}" + " --workers {threads}" * step["workers"]
    return f"{words} || [ $? -eq 1 ]" if step["may_reject"] else words


def name_of(rule_name):
    return lambda wildcards: step_of(rule_name, wildcards)["name"]


def key_of(rule_name):
    """What a step depends on, the package's source among it: a change of it runs the job again."""
    return lambda wildcards: PLAN["keys"][step_of(rule_name, wildcards)["name"]]


for rule_name, steps in STEPS.items():
    batch = "-{batch}" if steps[0]["temporary"] else ""

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
            source=PLAN["source_code_hash"],
        threads: steps[0]["threads"]
        resources:
            mem_mb=steps[0]["memory"],
            runtime=steps[0]["minutes"],
        retries: 2
        shell:
            f"( {called(steps[0])} ) > {{log}} 2>&1"
