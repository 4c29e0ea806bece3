"""Where the cameras stand: extrinsics from views of a board that several cameras share."""
