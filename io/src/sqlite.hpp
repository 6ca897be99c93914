#pragma once
/// An SQLite database file: statements as objects, faults as the exceptions of this module.

#include <cstdint>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

struct sqlite3;
struct sqlite3_stmt;

namespace trihedron::io {

/// Closed and rolled back where it goes without commit. Throws InputRefused for a file that is no whole database,
/// MachineFailed when the disk fails or another program holds the file.
class SqliteDatabase {
 public:
  enum class Access { kRead, kWrite };  ///< to write it is made where it is not there

  SqliteDatabase(std::filesystem::path file, Access access);

  /// Statements without result.
  void execute(const std::string& statements);
  /// Of a statement with one number as result, such as a PRAGMA.
  [[nodiscard]] std::int64_t number(const std::string& query);
  [[nodiscard]] std::int64_t last_row() const;

 private:
  friend class SqliteStatement;
  struct Close {
    void operator()(sqlite3* database) const;
  };
  /// Throws for any code but SQLITE_OK, SQLITE_ROW and SQLITE_DONE.
  void check(int code) const;

  std::filesystem::path file_;
  std::unique_ptr<sqlite3, Close> database_;
};

/// One statement of a database, which must outlive it. Parameters and columns count from 0.
class SqliteStatement {
 public:
  SqliteStatement(SqliteDatabase& database, std::string_view text);

  void bind(int parameter, std::string_view text);
  void bind(int parameter, double number);
  void bind(int parameter, std::int64_t number);
  /// True while there is a row.
  bool step();
  /// To be bound and run again.
  void reset();

  [[nodiscard]] std::string text(int column) const;
  [[nodiscard]] std::int64_t number(int column) const;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  SqliteDatabase& database_;
  std::unique_ptr<sqlite3_stmt, Finalize> statement_;
};

}  // namespace trihedron::io
