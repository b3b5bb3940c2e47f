"""Pictures to panorama.

In the order in which to read: `view` (one camera's pictures), `layout` (which columns of the
panorama are whose), `seam` (where neighbours agree best), `blend` (how they meet there), `gain`
(how they become equally bright), `compositor` (all of it, frame after frame). `stale` marks
cameras that went silent; `parallel` shares the rows between threads.
"""
