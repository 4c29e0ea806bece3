"""The wizards: one window for all, and how to add a calibration.

A calibration is one file, ``rhot_app/calibration/kinds/NAME.py``, without Qt. Its record, a
`rhot_app.calibration.registry.Calibration`, names what it collects, solves, reports, proposes and checks. The
Calibrate menu, the wizard, `rhot calibrate`, a rig's history and its health follow from it;
tests/ui/wizards/new_kinds/toy.py is an example. ``report`` makes a `rhot_app.calibration.report.Report` with each
figure once, ``propose`` a `rhot_app.calibration.proposal.Proposal` of the rig that would be in force.

To add one:

1. write the file, its place in `rhot_app.calibration.registry.ORDER`, and at the same place a row and a section with
   its title in docs/guide/calibration.md. Import what computes inside the functions: menus and help must stay fast.
   Name each code of a finding in a test;
2. run ``python resources/translations/update.py``, translate what is new in ``rhot_de.ts``, and run it again;
3. `rhot_app.calibration.collect` describes what is collected: movements that are recorded, lengths that are measured,
   or what the engine finds while it tracks. Only if there is something of its own to show, leave ``collect`` empty and
   write ``rhot_app/ui/wizards/NAME.py`` with ``make_wizard(context)``, which gives a
   `framework.definition.Definition` of the steps and pages that are its own;
4. a command's word is one of its title, and its help ends with two examples: kinds/depth.py shows one in full;
5. test it as a person would: in tests/ui/wizards, `Hands` clicks and `FakeRigClient` draws pictures. Run it once in
   tests/ui/wizards/on_simulated_rig, as a study with its row in CONTRIBUTING.md. ``hands.keep(NAME)`` takes a page's
   picture for the guide where RHOT_UPDATE_SCREENSHOTS is 1: open it.

A step (`framework.step.Step`) knows no widgets: its state, the sentence that says what to do now, the bars, whether it
is done. `observe` looks at pictures in a worker's thread and changes nothing; `accept_observation` gets what it found.
All but `observe` is called in the window's thread and must be quick. A page (`framework.page.Page`) hands what a
person does to its step and emits `changed`; a step without controls needs no class: ``Page(step)``. Movements are
recorded by `framework.movement.Movements`, boards found by `framework.board.BoardStep`, results computed by
`framework.step.SolveStep`, and `framework.definition.accept_result` makes the last page: before and after.

A `SolveStep` has the record's ``solve`` computed in a process of its own (`rhot_app.ui.backend.solver`) with remaining
time and cancel, while pictures stay live. What `context.connect()` gives is used in workers only: `Job`,
`Definition.put_back`.

Live pictures (`rhot_app.ui.backend.feed`) are the nodes' stills in full size;
`framework.picture_worker.PictureWorker` calls `observe` with the newest of all cameras. What a step draws over them is
in `framework.drawing`, in px of the full frame.
"""
