#include "sqlite.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <utility>

#include "trihedron/io/error.hpp"

namespace trihedron::io {

namespace {

constexpr int kPatience_ms = 2000;  // for another program that writes

}  // namespace

void SqliteDatabase::Close::operator()(sqlite3* database) const { sqlite3_close(database); }

SqliteDatabase::SqliteDatabase(std::filesystem::path file, Access access) : file_(std::move(file)) {
  const int flags = access == Access::kRead ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE;
  sqlite3* opened = nullptr;
  // A relative name could be one that means something else to SQLite, ":memory:".
  const int code = sqlite3_open_v2(std::filesystem::absolute(file_).c_str(), &opened, flags, nullptr);
  database_.reset(opened);
  check(code);
  check(sqlite3_busy_timeout(opened, kPatience_ms));
}

void SqliteDatabase::check(int code) const {
  switch (code & 0xff) {  // the primary code
    case SQLITE_OK:
    case SQLITE_ROW:
    case SQLITE_DONE:
      return;
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
    case SQLITE_ERROR:
      throw InputRefused(file_, {}, fmt::format("is damaged or no database: {}", sqlite3_errmsg(database_.get())),
                         "restore it from a copy, or give the name of a new one");
    default:
      throw MachineFailed(
          file_, fmt::format("cannot be read or written: {}", sqlite3_errmsg(database_.get())),
          "check that the directory is there and may be written, that the disk has room, and that no other program "
          "holds the file");
  }
}

void SqliteDatabase::execute(const std::string& statements) {
  check(sqlite3_exec(database_.get(), statements.c_str(), nullptr, nullptr, nullptr));
}

std::int64_t SqliteDatabase::number(const std::string& query) {
  SqliteStatement statement(*this, query);
  statement.step();
  return statement.number(0);
}

std::int64_t SqliteDatabase::last_row() const { return sqlite3_last_insert_rowid(database_.get()); }

void SqliteStatement::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }

SqliteStatement::SqliteStatement(SqliteDatabase& database, std::string_view text) : database_(database) {
  sqlite3_stmt* prepared = nullptr;
  database_.check(
      sqlite3_prepare_v2(database_.database_.get(), text.data(), static_cast<int>(text.size()), &prepared, nullptr));
  statement_.reset(prepared);
}

void SqliteStatement::bind(int parameter, std::string_view text) {
  database_.check(
      sqlite3_bind_text64(statement_.get(), parameter + 1, text.data(), text.size(), SQLITE_TRANSIENT, SQLITE_UTF8));
}

void SqliteStatement::bind(int parameter, double number) {
  database_.check(sqlite3_bind_double(statement_.get(), parameter + 1, number));
}

void SqliteStatement::bind(int parameter, std::int64_t number) {
  database_.check(sqlite3_bind_int64(statement_.get(), parameter + 1, number));
}

bool SqliteStatement::step() {
  const int code = sqlite3_step(statement_.get());
  database_.check(code);
  return code == SQLITE_ROW;
}

void SqliteStatement::reset() { sqlite3_reset(statement_.get()); }

std::string SqliteStatement::text(int column) const {
  const auto* bytes = static_cast<const char*>(sqlite3_column_blob(statement_.get(), column));
  const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_.get(), column));
  return bytes == nullptr ? std::string() : std::string(bytes, size);
}

std::int64_t SqliteStatement::number(int column) const { return sqlite3_column_int64(statement_.get(), column); }

}  // namespace trihedron::io
