"""The wizards: one window for all, and how to add a calibration with one.

A calibration is two files:

* ``rhot_app/calibration/commands/NAME.py``: its command, the work as a function, ``report(result)``: a
  `rhot_app.calibration.report.Report` with each figure once, and ``propose(result, rig)``: a
  `rhot_app.calibration.proposal.Proposal` of the rig that would be in force. Without Qt; printed lines, JSON and the
  wizard's table follow from them.
* ``rhot_app/ui/wizards/NAME.py``: ``make_wizard(context) -> Definition``, with the steps and pages that are its own.

A step (`models.step.Step`) knows no widgets: its state, the sentence that says what to do now, the bars, whether it is
done. `observe` looks at pictures in a worker's thread and changes nothing; `accept_observation` gets what it found. All
but `observe` is called in the window's thread and must be quick. A page (`framework.page.Page`) hands what a person
does to its step and emits `changed`; a step without controls needs no class: ``Page(step)``. Movements are recorded by
`framework.movement_page.Movements`, boards found by `models.board_form.BoardStep`, results computed by
`models.step.SolveStep`, and `framework.definition.accept_result` makes the last page: before and after.

To add one:

1. add a record to `rhot_app.calibration.registry`, and a section with its title to docs/guide/calibration.md, at the
   same place. The Calibrate menu, `rhot calibrate` and the history follow;
2. write both files; tests/ui/wizards/toy_calibration.py and toy.py are an example;
3. test it as a person would: in tests/ui/wizards, `Hands` clicks and `FakeRigAsker` draws pictures. Run it once in
   tests/ui/wizards/on_simulated_rig. ``hands.keep(NAME)`` takes a page's picture for the guide: open it.

The work of a `SolveStep` is a `models.step.Task`: a module function without Qt with a `progress` argument. It runs in a
process of its own (`rhot_app.ui.backend.solver`) with remaining time and cancel, while pictures stay live. What
`context.connect()` gives is used in workers only: `Job`, `Definition.put_back`.

Live pictures (`rhot_app.ui.backend.feed`) are the nodes' stills in full size; `framework.work.PictureWorker` calls
`observe` with the newest of all cameras. What a step draws over them is in `models.drawing`, in px of the full frame.
"""
