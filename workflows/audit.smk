"""The causal audit: does a policy obey its mask because of the mask?

Taken from the workflow: OUT, RESULTS, AUDITED (how many scenes), AUDIT_NEEDS (files of the policies), and AUDIT_FLAGS (the
policy, the one that it is compared with, and how both are played).
"""


# Its plays stay in OUT; the page is what lands.
rule audit:
    input:
        unless_there(f"{RESULTS}/audit/audit.json", AUDIT_NEEDS),
    output:
        f"{RESULTS}/audit/audit.json",
    log:
        f"{OUT}/audit.log",
    shell:
        "lerobot-excav audit {AUDIT_FLAGS} --scenes={AUDITED} --workers=1 --out={OUT}/audit > {log} 2>&1 && "
        "cp {OUT}/audit/audit* $(dirname {output})/"
