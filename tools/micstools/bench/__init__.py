"""What `make bench` measures and how: jobs, growth, the pressure system, other programs."""
