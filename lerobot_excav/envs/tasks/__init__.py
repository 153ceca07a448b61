"""What machines are asked to do: one folder per task, and one environment that plays any of them."""
