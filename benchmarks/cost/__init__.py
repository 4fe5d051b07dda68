"""What a substep costs: the blocks that are dropped, the contest, the peer, and the page."""
