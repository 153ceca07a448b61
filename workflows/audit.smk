"""The causal audit: does a policy obey its mask because of the mask?

Taken from the workflow: OUT, RESULTS, AUDITED (how many scenes), AUDIT_NEEDS (files of the policies), AUDIT_FLAGS (the
policy, the one that it is compared with, and how both are played), and AUDIT_DONE: who has this file has the audit.
"""


# Its plays stay in OUT; the page is what lands.
rule audit:
    input:
        unless_there(AUDIT_DONE, AUDIT_NEEDS),
    output:
        AUDIT_DONE,
    log:
        f"{OUT}/audit.log",
    shell:
        "lerobot-excav audit {AUDIT_FLAGS} --scenes={AUDITED} --workers=1 --out={OUT}/audit > {log} 2>&1 && "
        "mkdir -p {RESULTS}/audit && cp {OUT}/audit/audit* {RESULTS}/audit/ && touch {output}"
