"""Tables of records: a model that shows each record as a row by its columns, and a view with the app's look."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from PySide6.QtCore import QAbstractTableModel, QModelIndex, QPersistentModelIndex, Qt, Signal
from PySide6.QtWidgets import QAbstractItemView, QHeaderView, QTableView, QWidget

R = TypeVar("R")
Index = QModelIndex | QPersistentModelIndex

_LEFT = Qt.AlignmentFlag.AlignLeft | Qt.AlignmentFlag.AlignVCenter
_RIGHT = Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter


@dataclass(frozen=True)
class Column(Generic[R]):
    """What a column says of a record, and its `head` as it is shown. `roles` gives what else Qt asks for: tooltip,
    colours, icon. `write` takes a text that was typed over; without it the cell cannot be edited. `number` stands at
    the right."""

    head: str
    text: Callable[[R], str]
    number: bool = False
    roles: Callable[[R], Mapping[int, Any]] | None = None
    write: Callable[[R, str], None] | None = None


class RecordModel(QAbstractTableModel, Generic[R]):
    """`records` as rows, `columns` as columns."""

    def __init__(self, columns: Sequence[Column[R]], parent: QWidget | None = None) -> None:
        super().__init__(parent)
        self.columns = tuple(columns)
        self.records: list[R] = []

    def show_records(self, records: Sequence[R], columns: Sequence[Column[R]] | None = None) -> None:
        """Show these, by other `columns` where given. As many rows as before keep selection and scroll position."""
        if columns is None and len(records) == len(self.records):
            self.records = list(records)
            self.refresh()
            return
        self.beginResetModel()
        self.records = list(records)
        self.columns = self.columns if columns is None else tuple(columns)
        self.endResetModel()

    def refresh(self, first_column: int = 0) -> None:
        """The records say something else now, from a column on; what is being typed over in one of these is lost."""
        if self.records:
            self.dataChanged.emit(self.index(0, first_column),
                                  self.index(len(self.records) - 1, len(self.columns) - 1))

    def rowCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008, N802
        """How many records there are."""
        return 0 if parent.isValid() else len(self.records)

    def columnCount(self, parent: Index = QModelIndex()) -> int:  # noqa: B008, N802
        """How many columns there are."""
        return 0 if parent.isValid() else len(self.columns)

    def data(self, index: Index, role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """What Qt asks for of one cell."""
        column, record = self.columns[index.column()], self.records[index.row()]
        if role in (Qt.ItemDataRole.DisplayRole, Qt.ItemDataRole.EditRole):
            return column.text(record)
        if role == Qt.ItemDataRole.TextAlignmentRole and column.number:
            return _RIGHT
        return None if column.roles is None else column.roles(record).get(role)

    def headerData(self, section: int, orientation: Qt.Orientation,  # noqa: N802
                   role: int = Qt.ItemDataRole.DisplayRole) -> Any:
        """The columns' heads, and the rows' numbers where a table shows them."""
        if role != Qt.ItemDataRole.DisplayRole:
            return None
        return self.columns[section].head if orientation == Qt.Orientation.Horizontal else section + 1

    def flags(self, index: Index) -> Qt.ItemFlag:
        """Cells with a `write` can be typed over."""
        editable = index.isValid() and self.columns[index.column()].write is not None
        return super().flags(index) | (Qt.ItemFlag.ItemIsEditable if editable else Qt.ItemFlag.NoItemFlags)

    def setData(self, index: Index, value: Any, role: int = Qt.ItemDataRole.EditRole) -> bool:  # noqa: N802
        """Hand a typed text to the column."""
        write = self.columns[index.column()].write
        if write is None or role != Qt.ItemDataRole.EditRole:
            return False
        write(self.records[index.row()], str(value))
        return True


class RecordTable(QTableView, Generic[R]):
    """A `RecordModel` with heads at the left and no numbers of rows; whole rows are chosen, one or none.

    `chosen_changed` when another row is selected; `chosen` is its record.
    """

    chosen_changed = Signal()

    def __init__(self, columns: Sequence[Column[R]], parent: QWidget | None = None, *, selectable: bool = True) -> None:
        super().__init__(parent)
        self.records_model: RecordModel[R] = RecordModel(columns, self)
        self.setModel(self.records_model)
        self.verticalHeader().hide()
        self.horizontalHeader().setDefaultAlignment(_LEFT)
        self.horizontalHeader().setHighlightSections(False)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        if not selectable:
            self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
            self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.selectionModel().selectionChanged.connect(lambda *_: self.chosen_changed.emit())

    @property
    def records(self) -> list[R]:
        """What is shown, a row each."""
        return self.records_model.records

    def show_records(self, records: Sequence[R], columns: Sequence[Column[R]] | None = None) -> None:
        """Show these; see `RecordModel.show_records`. `chosen_changed` follows when the selection is gone with them."""
        before = bool(self.chosen_rows)
        self.records_model.show_records(records, columns)
        if before and not self.chosen_rows:
            self.chosen_changed.emit()

    @property
    def chosen_rows(self) -> list[int]:
        """Numbers of the selected rows, from the top."""
        return sorted(index.row() for index in self.selectionModel().selectedRows())

    @property
    def chosen(self) -> R | None:
        """The record of the selected row."""
        rows = self.chosen_rows
        return self.records[rows[0]] if rows else None

    def text(self, row: int, column: int) -> str:
        """What a cell says."""
        return str(self.records_model.index(row, column).data())

    def heads(self) -> list[str]:
        """What the columns are called."""
        return [column.head for column in self.records_model.columns]

    def fit_columns(self) -> None:
        """Every column as wide as its longest text, the last one as wide as the room that is left."""
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
        self.horizontalHeader().setStretchLastSection(True)

    def fill_width(self) -> None:
        """The first column, which says what a row is about, as wide as its longest text; the others share the rest."""
        self.horizontalHeader().setSectionResizeMode(QHeaderView.ResizeMode.Stretch)
        self.records_model.modelReset.connect(self._keep_names_whole)
        self._keep_names_whole()

    def _keep_names_whole(self) -> None:
        if self.records_model.columns:
            self.horizontalHeader().setSectionResizeMode(0, QHeaderView.ResizeMode.ResizeToContents)
