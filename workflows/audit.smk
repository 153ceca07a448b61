"""The causal audit: does a policy obey its mask because of the mask?

Taken from the workflow: OUT, RESULTS, AUDITED (how many scenes), and AUDITS: by the name of an audit's folder in RESULTS, the
files that it needs and its flags (the policy, what it is compared with, and how both are played). Who has the folder has
the audit.
"""

from pathlib import Path


def audit_done(name):
    """Return the file that says that an audit is there."""
    return f"{RESULTS}/{name}/audit.json"


# Its plays stay in OUT; the page is what lands.
rule audit:
    input:
        lambda wildcards: unless_there(audit_done(wildcards.audit), AUDITS[wildcards.audit][0]),
    output:
        audit_done("{audit}"),
    params:
        flags=lambda wildcards: AUDITS[wildcards.audit][1],
        folder=lambda wildcards, output: Path(output[0]).parent,
    wildcard_constraints:
        audit="|".join(AUDITS),
    log:
        f"{OUT}/{{audit}}.log",
    shell:
        "lerobot-excav audit {params.flags} --scenes={AUDITED} --workers=1 --out={OUT}/{wildcards.audit} > {log} 2>&1 && "
        "mkdir -p {params.folder} && cp {OUT}/{wildcards.audit}/audit* {params.folder}/ && touch {output}"
