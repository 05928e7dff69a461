"""Things that hide people: one file a class, each with Spec, sample and make."""
