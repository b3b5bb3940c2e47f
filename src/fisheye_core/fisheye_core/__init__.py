"""What every package builds on, without ROS: settings, files, errors and worker threads.

Begin with `errors` (one root, a family for each kind of cause) and `settings` (dataclass fields
that know their range and help). Files: `yaml_file`, `picture_file`, `coded_picture`, `encodings`.
Threads: `latest_only` (a worker that never falls behind), `background` (slow jobs in order),
`parallel` (one job cut into pieces), `rate_meter`.
"""
