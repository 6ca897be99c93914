// A catalogue that somebody has worked on with SQL: the input is what he did.
#include <sqlite3.h>

#include <cstring>
#include <string>

#include "fixtures.hpp"
#include "target.hpp"
#include "trihedron/io/catalogue.hpp"

namespace {

/// Whoever makes the file may do with it what he wants, but for other files.
int authorize(void*, int action, const char* first, const char*, const char*, const char*) {
  const bool harms = action == SQLITE_ATTACH || (action == SQLITE_PRAGMA && std::strstr(first, "directory") != nullptr);
  return harms ? SQLITE_DENY : SQLITE_OK;
}

int enough(void*) { return 1; }

void work_on(const std::filesystem::path& file, const std::string& statements) {
  constexpr int kSteps = 200'000;
  constexpr int kLongest = 1 << 20;
  sqlite3* database = nullptr;
  trihedron::fuzz::expect(sqlite3_open(file.c_str(), &database) == SQLITE_OK, "a catalogue to work on");
  sqlite3_set_authorizer(database, authorize, nullptr);
  sqlite3_progress_handler(database, kSteps, enough, nullptr);
  sqlite3_limit(database, SQLITE_LIMIT_LENGTH, kLongest);
  sqlite3_exec(database, "PRAGMA synchronous = OFF; PRAGMA writable_schema = ON", nullptr, nullptr, nullptr);
  sqlite3_exec(database, statements.c_str(), nullptr, nullptr, nullptr);
  sqlite3_close(database);
}

}  // namespace

void trihedron::fuzz::read_catalogue_sql(std::string_view bytes) {
  static const std::string original = [] {
    const DirectoryFile file("");
    const CatalogueEntry entry{"Resurs-DK1", "pass-a", "2009-05-20", 1, io::sample_calibration()};
    io::add_to_catalogue(file.path(), {&entry, 1});
    return io::read_text(file.path());
  }();
  const DirectoryFile file(original);
  work_on(file.path(), std::string(bytes));
  static_cast<void>(io::read_catalogue(file.path()));
  const CatalogueEntry entry{"Resurs-DK1", "another", "2009-05-21", 1, io::sample_calibration()};
  io::add_to_catalogue(file.path(), {&entry, 1});
}
