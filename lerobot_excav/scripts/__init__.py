"""The subcommands of `lerobot-excav`, one thin file each; `main` lists them."""
