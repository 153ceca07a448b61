"""Completing what lerobot-record recorded, by playing it again."""
